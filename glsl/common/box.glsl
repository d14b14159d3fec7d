// Ray against box, by slabs. Rounding must never lose a box that holds a hit, so boxes are widened
// once a ray by BOX_SLACK of the largest distance between origin and scene, per axis: this covers
// the rounding of both the slabs and the triangle test (measured: no differing bit over millions
// of rays), and leaves a node two subtractions and two products.

uniform vec3 scene_lo;
uniform vec3 scene_hi;

const float BOX_SLACK = 3.8e-6;

vec3 box_slack(Ray ray) {
    return BOX_SLACK * max(abs(scene_lo - ray.origin), abs(scene_hi - ray.origin));
}

float max_component(vec3 v) {
    return max(max(v.x, v.y), v.z);
}

float min_component(vec3 v) {
    return min(min(v.x, v.y), v.z);
}

// Interval of a ray in a box whose corners are ordered along the ray; empty where x > y.
vec2 slab_interval(Ray ray, vec3 slack, vec3 near, vec3 far) {
    vec3 ahead = vec3(ray.direction.x < 0.0 ? -slack.x : slack.x,
                      ray.direction.y < 0.0 ? -slack.y : slack.y,
                      ray.direction.z < 0.0 ? -slack.z : slack.z);
    vec3 enter = (near - (ray.origin + ahead)) * ray.inv_dir;
    vec3 exit = (far - (ray.origin - ahead)) * ray.inv_dir;
    return vec2(max_component(enter), min_component(exit));
}

// Interval of a ray in a box given by its lower and upper corner.
vec2 box_interval(Ray ray, vec3 slack, vec3 lo, vec3 hi) {
    vec3 a = (lo - (ray.origin + slack)) * ray.inv_dir;
    vec3 b = (hi - (ray.origin - slack)) * ray.inv_dir;
    return vec2(max_component(min(a, b)), min_component(max(a, b)));
}
