// Rays against a kd-tree's planes. One expression serves splits and boxes, so that the t of a plane
// is the same wherever it comes from.

#include "core/axis.glsl"

// Where the ray crosses a plane across `axis`.
float plane_t(Ray ray, int axis, float plane) {
    return R(R(plane - along(axis, ray.origin)) * along(axis, ray.inv_dir));
}

// Where it crosses one of each axis.
vec3 planes_t(Ray ray, vec3 planes) {
    return R(R(planes - ray.origin) * ray.inv_dir);
}

bvec3 goes_down(Ray ray) {
    return lessThan(ray.inv_dir, vec3(0.0));
}

// Where it enters a box.
float box_entry(Ray ray, vec3 lo, vec3 hi) {
    return max_component(planes_t(ray, mix(lo, hi, goes_down(ray))));
}

float box_exit(Ray ray, vec3 lo, vec3 hi) {
    return min_component(planes_t(ray, mix(hi, lo, goes_down(ray))));
}
