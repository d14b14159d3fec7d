// Each ray of a packet tests a triangle by itself.

// A ray's dominant axis adds 0 to the number of the ray's turn (drivers/packet_turns.glsl), because the
// rays of a turn need not share a dominant axis.
int shared_axis(Ray ray) {
    return 0;
}

void find_start(int r) {
}

void test_rays() {
    EACH(test_ray)
}
