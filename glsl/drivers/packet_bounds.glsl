// One test of a box for all rays of a packet, by interval arithmetic: Wald, Boulos, Shirley, "Ray
// Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies", TOG 2007. The present rays
// agree in the signs of their directions (see packet_turns.glsl). Each operation here is one of
// box_interval's on the outermost of its rays' values, and rounding is monotonic: no ray is in a box
// outside of this interval.
//
// Bounds of rays that begin far apart hold next to everything: where a silhouette parts the shadow rays
// of a packet, it would walk through most of the tree. So of rays that wait for a turn those come
// that begin within REACH of the first, on every axis.

// Of the scene's largest side. Shadow rays at 1024x1024 take, by reach 0.1, 0.01 and 0.001: 4.9, 1 and 1.2
// times as long in the kitchen, 1, 1 and 3.0 times on the bunny (software renderer).
const float REACH = 0.01;

#ifdef RAYS_TEXEL_0_UNIFORM   // all rays begin at one point

void find_neighbourhood() {
}

bool begins_near(int r) {
    return true;
}

#else

float reach;
vec3 beginning;      // of the first ray that waits
bool found_beginning;

void find_beginning(int r) {
    bool first = !found_beginning && t_turn[r] != NEVER;
    beginning = first ? rays[r].origin : beginning;
    found_beginning = found_beginning || first;
}

void find_neighbourhood() {
    reach = REACH * max_component(scene_hi - scene_lo);
    found_beginning = false;
    EACH(find_beginning)
}

bool begins_near(int r) {
    return max_component(abs(rays[r].origin - beginning)) <= reach;
}

#endif

vec3 first_origin;   // what the corners of a box, in the order that rays meet them, are measured from
vec3 last_origin;
vec3 inv_lo;
vec3 inv_hi;
float t_first;
float t_last;
vec3 along;          // signs of the directions
bvec3 reversed;

vec3 chosen(bvec3 which, vec3 yes, vec3 no) {
    return vec3(which.x ? yes.x : no.x, which.y ? yes.y : no.y, which.z ? yes.z : no.z);
}

void bound_ray(int r) {
    Ray ray = rays[r];
    bool here = ray.t_min < NEVER;
#ifndef RAYS_TEXEL_0_UNIFORM
#ifdef OCTANTS
    vec3 first = ray.lo_origin;
    vec3 last = ray.hi_origin;
#else
    vec3 first = chosen(reversed, ray.hi_origin, ray.lo_origin);
    vec3 last = chosen(reversed, ray.lo_origin, ray.hi_origin);
#endif
    first_origin = here ? max(first_origin, first * along) : first_origin;
    last_origin = here ? min(last_origin, last * along) : last_origin;
#endif
    inv_lo = here ? min(inv_lo, ray.inv_dir) : inv_lo;
    inv_hi = here ? max(inv_hi, ray.inv_dir) : inv_hi;
    t_first = min(t_first, ray.t_min);
}

void bound_t_hit(int r) {
    t_last = rays[r].t_min < NEVER ? max(t_last, hits[r].t) : t_last;
}

// After a leaf: rays end at their hits.
void bound_hits() {
    t_last = -NEVER;
    EACH(bound_t_hit)
}

void bound_rays() {
    reversed = negative_axes(turn);
    along = chosen(reversed, vec3(-1.0), vec3(1.0));
    first_origin = vec3(-NEVER);
    last_origin = vec3(NEVER);
    inv_lo = vec3(NEVER);
    inv_hi = vec3(-NEVER);
    t_first = NEVER;
    EACH(bound_ray)
#ifdef RAYS_TEXEL_0_UNIFORM
    vec3 slack = box_slack(rays[0].origin) * along;     // as ray_setup has it
    first_origin = R(rays[0].origin + slack);
    last_origin = R(rays[0].origin - slack);
#else
    first_origin *= along;
    last_origin *= along;
#endif
    bound_hits();
}

float end_by_sign(float a, float positive, float negative) {
    return floatBitsToInt(a) < 0 ? negative : positive;
}

vec3 ends_by_sign(vec3 a, vec3 positive, vec3 negative) {
    return vec3(end_by_sign(a.x, positive.x, negative.x), end_by_sign(a.y, positive.y, negative.y),
                end_by_sign(a.z, positive.z, negative.z));
}

// Interval of all present rays in a box; empty where x > y.
vec2 bounding_interval(vec3 lo, vec3 hi) {
#ifdef OCTANTS
    vec3 a = R(lo - first_origin);
    vec3 b = R(hi - last_origin);
#else
    vec3 a = R(chosen(reversed, hi, lo) - first_origin);
    vec3 b = R(chosen(reversed, lo, hi) - last_origin);
#endif
    // Which end of the interval of inverse directions bounds a product, its sign says.
    vec3 least = R(a * ends_by_sign(a, inv_lo, inv_hi));
    vec3 most = R(b * ends_by_sign(b, inv_hi, inv_lo));
    return vec2(larger(max_component(least), t_first), smaller(min_component(most), t_last));
}
