// One test of a box for all rays of a packet, by interval arithmetic: Wald, Boulos, Shirley, "Ray Tracing
// Deformable Scenes Using Dynamic Bounding Volume Hierarchies", TOG 2007.
//
// A turn (packet_turns.glsl) is a walk of rays whose directions agree in their signs. `searched` applies
// the operations of `box_interval` to the smallest and largest values of these rays. Rounding is monotonic,
// so if the result is empty, no ray of the turn meets the box.
//
// Departure: a turn includes only the waiting rays that begin within REACH of the first waiting ray, on
// every axis. If a silhouette splits a packet's shadow rays, bounds around all these rays would contain
// most of the scene. The packet would then walk through most of the tree.

#define TESTERS(f) f(0);   // calls f once for a box: one test serves all rays of the packet

// REACH is a share of the scene's largest side. It is the best of 0.1, 0.01 and 0.001 for shadow rays in
// the kitchen and on the bunny, on a software renderer.
const float REACH = 0.01;

vec3 first_origin;   // bound of the origins from which rays measure the box corner that they meet first
vec3 last_origin;    // bound of the origins from which rays measure the opposite corner
vec3 inv_lo;
vec3 inv_hi;
float t_first;
float t_last;
vec3 along;          // signs of the directions
bvec3 reversed;

vec3 chosen(bvec3 which, vec3 yes, vec3 no) {
    return vec3(which.x ? yes.x : no.x, which.y ? yes.y : no.y, which.z ? yes.z : no.z);
}

// The corner that the rays meet first, and the opposite corner. With OCTANTS, the boxes of nodes and a
// ray's lo_origin and hi_origin (core/ray.glsl) already have this order.
#ifdef OCTANTS

vec3 met_first(vec3 lo, vec3 hi) {
    return lo;
}

vec3 met_last(vec3 lo, vec3 hi) {
    return hi;
}

#else

vec3 met_first(vec3 lo, vec3 hi) {
    return chosen(reversed, hi, lo);
}

vec3 met_last(vec3 lo, vec3 hi) {
    return chosen(reversed, lo, hi);
}

#endif

#ifdef RAYS_TEXEL_0_UNIFORM   // all rays have one origin

void find_neighbourhood() {
}

bool begins_near(int r) {
    return true;
}

void bound_origin(int r) {
}

// Shift the shared origin outward, as ray_setup shifts the origins of each ray.
void finish_origins() {
    vec3 slack = box_slack(rays[0].origin) * along;
    first_origin = R(rays[0].origin + slack);
    last_origin = R(rays[0].origin - slack);
}

#else

float reach;
vec3 beginning;      // the origin of the first ray that waits
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

// Find the largest first origin and the smallest last origin along each axis. Where the directions are
// negative, the signs `along` negate both, so that maximum and minimum swap.
void bound_origin(int r) {
    Ray ray = rays[r];
    bool here = ray.t_min < NEVER;
    vec3 first = met_first(ray.lo_origin, ray.hi_origin);
    vec3 last = met_last(ray.lo_origin, ray.hi_origin);
    first_origin = here ? max(first_origin, first * along) : first_origin;
    last_origin = here ? min(last_origin, last * along) : last_origin;
}

void finish_origins() {
    first_origin *= along;
    last_origin *= along;
}

#endif

void bound_ray(int r) {
    Ray ray = rays[r];
    bool here = ray.t_min < NEVER;
    bound_origin(r);
    inv_lo = here ? min(inv_lo, ray.inv_dir) : inv_lo;
    inv_hi = here ? max(inv_hi, ray.inv_dir) : inv_hi;
    t_first = min(t_first, ray.t_min);
}

void bound_t_hit(int r) {
    t_last = rays[r].t_min < NEVER ? max(t_last, hits[r].t) : t_last;
}

// Update t_last, the latest end of the rays' searches. Call this after each leaf.
void bound_hits() {
    t_last = -NEVER;
    EACH(bound_t_hit)
}

// Bound the rays of the current turn.
void bound_rays() {
    reversed = negative_axes(turn);
    along = chosen(reversed, vec3(-1.0), vec3(1.0));
    first_origin = vec3(-NEVER);
    last_origin = vec3(NEVER);
    inv_lo = vec3(NEVER);
    inv_hi = vec3(-NEVER);
    t_first = NEVER;
    EACH(bound_ray)
    finish_origins();
    bound_hits();
}

float end_by_sign(float a, float positive, float negative) {
    return floatBitsToInt(a) < 0 ? negative : positive;
}

vec3 ends_by_sign(vec3 a, vec3 positive, vec3 negative) {
    return vec3(end_by_sign(a.x, positive.x, negative.x), end_by_sign(a.y, positive.y, negative.y),
                end_by_sign(a.z, positive.z, negative.z));
}

// Return an interval of t, from x to y. It contains the part of each ray that lies in the box and is still
// to be searched. The interval is empty if x > y.
vec2 searched(int r, vec3 lo, vec3 hi) {
    vec3 a = R(met_first(lo, hi) - first_origin);
    vec3 b = R(met_last(lo, hi) - last_origin);
    // Bound the products of all rays. The sign of `a` or `b` selects inv_lo or inv_hi.
    vec3 least = R(a * ends_by_sign(a, inv_lo, inv_hi));
    vec3 most = R(b * ends_by_sign(b, inv_hi, inv_lo));
    return vec2(larger(max_component(least), t_first), smaller(min_component(most), t_last));
}
