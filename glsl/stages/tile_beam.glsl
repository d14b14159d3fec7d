// A beam bounds all rays of a tile by intervals of origin, inverse direction and t, as Wald, Boulos and
// Shirley bound packets ("Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies", TOG
// 2007). `signs` says which signs the directions have along each axis: bit a is set for a negative sign on
// axis a, bit 3 + a for a positive sign.
//
// The test of a beam against a box needs no margin. It applies the operations of `box_interval`
// (core/box.glsl) to extreme values of the rays, and subtraction, product, minimum and maximum round
// monotonically. So if the interval of a ray is not empty, the interval of the beam is not empty, in any
// precision. If the directions have both signs along an axis, the axis does not bound the interval.

const float BEAM_END = 3.0e38;

bool is_mixed(int signs) {
    return (signs & signs >> 3 & 7) != 0;
}

// The octant of the directions. The caller ensures that all directions lie in one octant (`is_mixed`).
int octant_of(int signs) {
    return signs & 7;
}

// The intervals of t for a beam in a box. No ray is in the box at a t outside `outer`. If all rays have the
// same octant, every ray is in the box at every t within `core`. An interval is empty if x > y.
struct Beam_interval {
    vec2 outer;
    vec2 core;
};

void meet_slab(int signs, int axis, float lo, float hi, float lo_origin, float hi_origin,
               float inv_lo, float inv_hi, inout Beam_interval interval) {
    bool negative = (signs >> axis & 1) != 0;
    bool positive = (signs >> axis & 8) != 0;
    float first = negative ? R(hi - hi_origin) : R(lo - lo_origin);
    float last = negative ? R(lo - lo_origin) : R(hi - hi_origin);
    vec2 a = R(first * vec2(inv_lo, inv_hi));
    vec2 b = R(last * vec2(inv_lo, inv_hi));
    bool mixed = negative && positive;
    interval.outer.x = max(interval.outer.x, mixed ? -BEAM_END : min(a.x, a.y));
    interval.outer.y = min(interval.outer.y, mixed ? BEAM_END : max(b.x, b.y));
    interval.core.x = max(interval.core.x, mixed ? -BEAM_END : max(a.x, a.y));
    interval.core.y = min(interval.core.y, mixed ? BEAM_END : min(b.x, b.y));
}

Beam_interval beam_interval(Tile_beam beam, vec3 lo, vec3 hi) {
    Beam_interval interval = Beam_interval(vec2(beam.t_min, beam.t_max),
                                           vec2(beam.t_min, beam.t_max));
    meet_slab(beam.signs, 0, lo.x, hi.x, beam.lo_origin.x, beam.hi_origin.x,
              beam.inv_lo.x, beam.inv_hi.x, interval);
    meet_slab(beam.signs, 1, lo.y, hi.y, beam.lo_origin.y, beam.hi_origin.y,
              beam.inv_lo.y, beam.inv_hi.y, interval);
    meet_slab(beam.signs, 2, lo.z, hi.z, beam.lo_origin.z, beam.hi_origin.z,
              beam.inv_lo.z, beam.inv_hi.z, interval);
    return interval;
}

bool is_met(Beam_interval interval) {
    return !(interval.outer.x > interval.outer.y);
}

// Estimate, from the mean of `outer` and `core`, whether at least half of the beam's rays meet the box.
bool by_most(Beam_interval interval) {
    return interval.core.x + interval.outer.x <= interval.core.y + interval.outer.y;
}

Tile_beam no_beam() {
    return Tile_beam(vec3(-BEAM_END), BEAM_END, vec3(BEAM_END), -BEAM_END, vec3(BEAM_END), 0,
                     vec3(-BEAM_END), 0);
}

Tile_beam joined(Tile_beam a, Tile_beam b) {
    return Tile_beam(max(a.lo_origin, b.lo_origin), min(a.t_min, b.t_min),
                     min(a.hi_origin, b.hi_origin), max(a.t_max, b.t_max),
                     min(a.inv_lo, b.inv_lo), a.signs | b.signs,
                     max(a.inv_hi, b.inv_hi), a.live + b.live);
}
