// Each ray of a packet tests a triangle by itself.

// What the dominant axis of a ray adds to its turn: nothing, as the rays share no axes.
int shared_axis(Ray ray) {
    return 0;
}

void find_start(int r) {
}

void test_rays() {
    EACH(test_ray)
}
