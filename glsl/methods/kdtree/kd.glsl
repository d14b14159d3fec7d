// Computes the t of split planes and of the faces of boxes by one expression, so equal planes have equal t.

#include "core/axis.glsl"

// The t at which the ray crosses a plane perpendicular to `axis`.
float plane_t(Ray ray, int axis, float plane) {
    return R(R(plane - along(axis, ray.origin)) * along(axis, ray.inv_dir));
}

vec3 planes_t(Ray ray, vec3 planes) {
    return R(R(planes - ray.origin) * ray.inv_dir);
}

// For each axis, whether the ray's coordinate decreases.
bvec3 goes_down(Ray ray) {
    return lessThan(ray.inv_dir, vec3(0.0));
}

float box_entry(Ray ray, vec3 lo, vec3 hi) {
    return max_component(planes_t(ray, chosen(goes_down(ray), hi, lo)));
}

float box_exit(Ray ray, vec3 lo, vec3 hi) {
    return min_component(planes_t(ray, chosen(goes_down(ray), lo, hi)));
}
