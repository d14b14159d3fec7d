// Each ray of a packet tests a triangle by itself.

// Rays with different dominant axes may share a turn. So the axis adds 0 to the number of the ray's turn
// (drivers/packet_turns.glsl).
int shared_axis(Ray ray) {
    return 0;
}

void find_start(int r) {
}

void test_rays() {
    EACH(test_ray)
}
