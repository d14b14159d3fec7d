// Rays against a kd-tree's planes. One expression serves splits and boxes, so that the t of a plane
// is the same wherever it comes from.

#include "common/axis.glsl"

// Where the ray crosses a plane across `axis`.
float plane_t(Ray ray, int axis, float plane) {
    return R(R(plane - along(axis, ray.origin)) * along(axis, ray.inv_dir));
}

// Where it leaves a box, axis by axis.
vec3 box_exits(Ray ray, vec3 lo, vec3 hi) {
    vec3 last = vec3(ray.inv_dir.x < 0.0 ? lo.x : hi.x,
                     ray.inv_dir.y < 0.0 ? lo.y : hi.y,
                     ray.inv_dir.z < 0.0 ? lo.z : hi.z);
    return R(R(last - ray.origin) * ray.inv_dir);
}

// Where it enters one.
float box_entry(Ray ray, vec3 lo, vec3 hi) {
    vec3 first = vec3(ray.inv_dir.x < 0.0 ? hi.x : lo.x,
                      ray.inv_dir.y < 0.0 ? hi.y : lo.y,
                      ray.inv_dir.z < 0.0 ? hi.z : lo.z);
    return max_component(R(R(first - ray.origin) * ray.inv_dir));
}

float box_exit(Ray ray, vec3 lo, vec3 hi) {
    return min_component(box_exits(ray, lo, hi));
}

// The rope of the face that a ray leaves a leaf by, from where it crosses each (box_exits).
int rope_behind(Ray ray, vec3 exits, ivec3 ropes_lo, ivec3 ropes_hi) {
    float t_leave = min_component(exits);
    return exits.x == t_leave ? (ray.inv_dir.x < 0.0 ? ropes_lo.x : ropes_hi.x)
         : exits.y == t_leave ? (ray.inv_dir.y < 0.0 ? ropes_lo.y : ropes_hi.y)
         : (ray.inv_dir.z < 0.0 ? ropes_lo.z : ropes_hi.z);
}
