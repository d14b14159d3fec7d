// A triangle for the rays of a packet whose turn it is. With SHARED_AXES they agree in their dominant
// axis, so that they have the triangle's corners with the axes permuted in common, and where all rays
// of the image begin at one point the corners relative to that too. Each operation is one of
// test_triangle's on the same numbers, so the bits are the same. A method defines PRESENT(r).

#ifdef SHARED_AXES

vec3 corners[3];   // with RAYS_TEXEL_0_UNIFORM relative to the origin that all rays have

#ifdef RAYS_TEXEL_0_UNIFORM

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
        test_corners(rays[r], corner_seen(r, 0), corner_seen(r, 1), corner_seen(r, 2), tested, hit);
#ifdef ANY_HIT
        hit.u = hit.v = 0.0;   // nobody asks where a shadow ray is stopped
#endif
        hit.t = stored(hit.t);
#ifdef ROWS_ALONE
        rows[r] = hit.triangle != hits[r].triangle ? tested : rows[r];
#endif
        hits[r] = hit;
    }
}

void test_rays() {
    bvec2 axes = bvec2(turn < 8, turn < 16);
    take_corner(0, axes, triangle_v0(tested));
    take_corner(1, axes, triangle_v1(tested));
    take_corner(2, axes, triangle_v2(tested));
#ifdef STATISTICS
    counters.triangles_tested += RAYS;
#endif
    EACH(test_present)
}

#else

void test_rays() {
    EACH(test_ray)
}

#endif
