// The slab test of a ray against a box. Boxes are slightly widened (slack.glsl).

// llvmpipe's max and min also check for NaN and need a third instruction. No argument may be NaN here.
float larger(float a, float b) {
    PRECISE float found = a > b ? a : b;
    return found;
}

float smaller(float a, float b) {
    PRECISE float found = a < b ? a : b;
    return found;
}

float max_component(vec3 v) {
    return larger(larger(v.x, v.y), v.z);
}

float min_component(vec3 v) {
    return smaller(smaller(v.x, v.y), v.z);
}

// Return the interval of t in which a ray is inside a box: start x, end y. It is empty if x > y. With
// OCTANTS (a tree for each octant of directions), `lo` is the corner that the ray meets first.
vec2 box_interval(Ray ray, vec3 lo, vec3 hi) {
    vec3 a = R(R(lo - ray.lo_origin) * ray.inv_dir);
    vec3 b = R(R(hi - ray.hi_origin) * ray.inv_dir);
#ifdef OCTANTS
    return vec2(max_component(a), min_component(b));
#else
    return vec2(max_component(vec3(smaller(a.x, b.x), smaller(a.y, b.y), smaller(a.z, b.z))),
                min_component(vec3(larger(a.x, b.x), larger(a.y, b.y), larger(a.z, b.z))));
#endif
}
