// The slab test (Kay and Kajiya 1986) of the era form (docs/era.md). This file replaces core/box.glsl. The
// test does not widen boxes.

float larger(float a, float b) {
    return max(a, b);
}

float smaller(float a, float b) {
    return min(a, b);
}

float max_component(vec3 v) {
    return max(max(v.x, v.y), v.z);
}

float min_component(vec3 v) {
    return min(min(v.x, v.y), v.z);
}

// Return the interval of t in which a ray is inside a box: start x, end y. It is empty if x > y.
vec2 box_interval(Ray ray, vec3 lo, vec3 hi) {
    vec3 a = R(R(lo - ray.origin) * ray.inv_dir);
    vec3 b = R(R(hi - ray.origin) * ray.inv_dir);
    return vec2(max_component(min(a, b)), min_component(max(a, b)));
}
