// Each ray of a packet tests a box by itself.

#define TESTERS(f) EACH(f)   // calls f(r) for each ray r that tests boxes: here for every ray

void find_neighbourhood() {
}

bool begins_near(int r) {
    return true;
}

void bound_rays() {
}

void bound_hits() {
}

// The interval of t, from x to y, that ray r still has to search in a box; empty if x > y.
vec2 searched(int r, vec3 lo, vec3 hi) {
    vec2 interval = box_interval(rays[r], lo, hi);
    return vec2(larger(interval.x, rays[r].t_min), smaller(interval.y, hits[r].t));
}
