// Vertex culling: Reshetov, "Faster Ray Packets - Triangle Intersection through Vertex Culling", RT 2007. A
// packet skips a triangle whose corners all lie outside one side of the frustum around the packet's rays.
//
// The four sides follow from the watertight test. This test moves each corner, parallel to the ray, onto
// the plane through the ray's origin that is perpendicular to the dominant axis. It rejects a triangle if
// all moved corners have the same sign of x, or of y. Here the same operations work on intervals that
// contain the operands of all rays. Rounding is monotonic, so an interval contains the result of each ray.
// So every ray would reject a culled triangle, and culling needs no margin in any precision.
//
// Departures: the frustum is computed once for each turn of the packet (drivers/packet_turns.glsl), not in
// each leaf. It also contains rays that miss the leaf, so diverging rays cull little. If the rays have
// different dominant axes, the packet culls nothing.

vec3 cull_origin_lo;    // bounds of the rays' origins and shears; axes are permuted as in the test
vec3 cull_origin_hi;
vec2 cull_shear_lo;
vec2 cull_shear_hi;
bvec2 cull_dominant;
int cull_axes;          // number of different dominant axes among the rays; 2: two or more

void bound_for_culling(int r) {
    Ray ray = rays[r];
    bool here = PRESENT(r);
    bool first = here && cull_axes == 0;
    cull_dominant = bvec2(first ? ray.dominant.x : cull_dominant.x,
                          first ? ray.dominant.y : cull_dominant.y);
    bool other = cull_dominant.x != ray.dominant.x
              || (!ray.dominant.x && cull_dominant.y != ray.dominant.y);
    cull_axes = first ? 1 : here && other ? 2 : cull_axes;
    vec3 origin = permute(ray, ray.origin);
    cull_origin_lo = here ? min(cull_origin_lo, origin) : cull_origin_lo;
    cull_origin_hi = here ? max(cull_origin_hi, origin) : cull_origin_hi;
    cull_shear_lo = here ? min(cull_shear_lo, ray.shear.xy) : cull_shear_lo;
    cull_shear_hi = here ? max(cull_shear_hi, ray.shear.xy) : cull_shear_hi;
}

void bound_frustum() {
    cull_axes = 0;
    cull_dominant = bvec2(false);
    cull_origin_lo = vec3(NEVER);
    cull_origin_hi = vec3(-NEVER);
    cull_shear_lo = vec2(NEVER);
    cull_shear_hi = vec2(-NEVER);
    EACH(bound_for_culling)
}

// Return, for each of the four sides, whether a corner lies outside the side for all rays. The moved corner
// then has, in the order of the components, x < 0, y < 0, x > 0 or y > 0.
bvec4 sides_outside(vec3 corner) {
    vec3 at = permuted(cull_dominant, corner);
    PRECISE vec3 lo = R(at - cull_origin_hi);
    PRECISE vec3 hi = R(at - cull_origin_lo);
    PRECISE vec2 a = R(cull_shear_lo * lo.z);
    PRECISE vec2 b = R(cull_shear_lo * hi.z);
    PRECISE vec2 c = R(cull_shear_hi * lo.z);
    PRECISE vec2 d = R(cull_shear_hi * hi.z);
    PRECISE vec2 least = R(lo.xy - max(max(a, b), max(c, d)));
    PRECISE vec2 most = R(hi.xy - min(min(a, b), min(c, d)));
    return bvec4(lessThan(most, vec2(0.0)), greaterThan(least, vec2(0.0)));
}

// Return whether the packet can skip triangle i, because no ray of the turn can hit it.
bool culled(int i) {
    bvec4 a = sides_outside(triangle_v0(i));
    bvec4 b = sides_outside(triangle_v1(i));
    bvec4 c = sides_outside(triangle_v2(i));
    return cull_axes < 2 && ((a.x && b.x && c.x) || (a.y && b.y && c.y)
                          || (a.z && b.z && c.z) || (a.w && b.w && c.w));
}
