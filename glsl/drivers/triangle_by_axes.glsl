// The watertight test of a triangle for the rays of a turn (drivers/packet_turns.glsl), which have the same
// dominant axis. The triangle's normal and permuted corners are computed once for all rays. If all rays of
// the image share an origin, the corners relative to this origin are computed once, too. The operations are
// those of `test_triangle`, so the hits have the same bits. A method defines PRESENT(r), which says whether
// ray r tests the triangle.

int shared_axis(Ray ray) {
    return ray.dominant.x ? 0 : ray.dominant.y ? 8 : 16;
}

vec3 corners[3];   // axes permuted; relative to the origin if all rays have one origin
vec3 tested_normal;   // of the triangle `tested`; see `plane_normal` in core/watertight.glsl
bvec2 tested_apex;

#ifdef RAYS_TEXEL_0_UNIFORM   // all rays have one origin

void find_start(int r) {
}

vec3 corner_seen(int r, int k) {
    return corners[k];
}

void take_corner(int k, bvec2 axes, vec3 corner) {
    corners[k] = seen_from(permuted(axes, rays[0].origin), axes, corner);
}

#else

vec3 starts[RAYS];   // the origins, axes permuted

void find_start(int r) {
    starts[r] = permuted(bvec2(turn < 8, turn < 16), rays[r].origin);
}

vec3 corner_seen(int r, int k) {
    PRECISE vec3 p = R(corners[k] - starts[r]);
    return p;
}

void take_corner(int k, bvec2 axes, vec3 corner) {
    corners[k] = permuted(axes, corner);
}

#endif

void test_present(int r) {
    if (PRESENT(r)) {
        Hit hit = hits[r];
        test_corners(rays[r], tested, corner_seen(r, 0), corner_seen(r, 1), corner_seen(r, 2),
                     tested_normal, tested_apex, hit);
#ifdef ANY_HIT
        hit.u = hit.v = 0.0;   // no caller reads u and v of a shadow ray's hit
#endif
        hit.t = stored(hit.t);
        rows[r] = hit.triangle != hits[r].triangle ? tested : rows[r];
        hits[r] = hit;
    }
}

void test_rays() {
    bvec2 axes = bvec2(turn < 8, turn < 16);
    take_corner(0, axes, triangle_v0(tested));
    take_corner(1, axes, triangle_v1(tested));
    take_corner(2, axes, triangle_v2(tested));
    tested_normal = plane_normal(tested, axes, tested_apex);
    COUNT_SEVERAL(triangles_tested, RAYS);
    EACH(test_present)
}
