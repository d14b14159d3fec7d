// Ray against box, by slabs, a little widened (see slack.glsl).

float max_component(vec3 v) {
    return max(max(v.x, v.y), v.z);
}

float min_component(vec3 v) {
    return min(min(v.x, v.y), v.z);
}

// Interval of a ray in a box; empty where x > y. With OCTANTS the corners come ordered along the
// ray, `lo` the one it meets first.
vec2 box_interval(Ray ray, vec3 lo, vec3 hi) {
    vec3 a = R(R(lo - ray.lo_origin) * ray.inv_dir);
    vec3 b = R(R(hi - ray.hi_origin) * ray.inv_dir);
#ifdef OCTANTS
    return vec2(max_component(a), min_component(b));
#else
    return vec2(max_component(min(a, b)), min_component(max(a, b)));
#endif
}
