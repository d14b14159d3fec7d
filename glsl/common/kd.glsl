// Rays against a kd-tree's planes. One expression serves splits and boxes, so that the t of a plane
// is the same wherever it comes from.

const int LEAF = 3;   // from here on an axis is a leaf's number

// Where the ray crosses a plane across `axis`.
float plane_t(Ray ray, int axis, float plane) {
    float o = axis == 0 ? ray.origin.x : (axis == 1 ? ray.origin.y : ray.origin.z);
    float inv = axis == 0 ? ray.inv_dir.x : (axis == 1 ? ray.inv_dir.y : ray.inv_dir.z);
    return R(R(plane - o) * inv);
}

// Where it leaves a box, axis by axis.
vec3 box_exits(Ray ray, vec3 lo, vec3 hi) {
    vec3 last = vec3(ray.inv_dir.x < 0.0 ? lo.x : hi.x,
                     ray.inv_dir.y < 0.0 ? lo.y : hi.y,
                     ray.inv_dir.z < 0.0 ? lo.z : hi.z);
    return R(R(last - ray.origin) * ray.inv_dir);
}

float box_exit(Ray ray, vec3 lo, vec3 hi) {
    return min_component(box_exits(ray, lo, hi));
}
