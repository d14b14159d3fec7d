// A ray and its derived values, which each pass computes from the ray textures.

struct Ray {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max;
    vec3 inv_dir;    // finite: a zero component counts as TINY_DIRECTION
    bvec2 dominant;  // largest component: x if dominant.x, else y if dominant.y, else z
    vec3 shear;      // (x / z, y / z, 1 / z) of the direction, axes permuted so z is dominant
    vec3 lo_origin;  // the origins from which box_interval measures the corners `lo` and `hi` of a box
    vec3 hi_origin;  // (core/slack.glsl)
#ifdef AFTER_HIT
    int after;       // at exactly t_min, a ray hits only triangles with an index above this number
#endif
};

// A component nearer to 0 counts as this number with the component's sign. The largest is at least 0.5.
const float TINY_DIRECTION = 1e-20;

float not_zero(float d) {
    return abs(d) < TINY_DIRECTION ? (d < 0.0 ? -TINY_DIRECTION : TINY_DIRECTION) : d;
}

vec3 permuted(bvec2 dominant, vec3 v) {
    return dominant.x ? v.yzx : (dominant.y ? v.zxy : v);
}

vec3 permute(Ray ray, vec3 v) {
    return permuted(ray.dominant, v);
}

Ray ray_setup(Rays texels) {
    Ray ray;
    ray.origin = texels.origin;
    ray.t_min = texels.t_min;
    ray.direction = texels.direction;
    ray.t_max = texels.t_max;
#ifdef AFTER_HIT
    ray.after = texels.after;
#endif
    vec3 d = ray.direction;
    vec3 size = abs(d);
    ray.inv_dir = R(1.0 / vec3(not_zero(d.x), not_zero(d.y), not_zero(d.z)));
    ray.dominant.x = size.x >= size.y && size.x >= size.z;
    ray.dominant.y = size.y >= size.z;
    vec3 p = permute(ray, d);
    ray.shear = R(vec3(p.xy / p.z, 1.0 / p.z));
    vec3 slack = box_slack(ray.origin);
#ifdef OCTANTS
    slack = vec3(d.x < 0.0 ? -slack.x : slack.x, d.y < 0.0 ? -slack.y : slack.y,
                 d.z < 0.0 ? -slack.z : slack.z);
#endif
    ray.lo_origin = R(ray.origin + slack);
    ray.hi_origin = R(ray.origin - slack);
    return ray;
}
