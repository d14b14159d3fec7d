#version 330 core
// What rays are sorted by: a cell of the box that all origins lie in, and a cell of the directions.
// The survey proposes sorting rays (section 4.3; fact sheet I) and leaves the key open. A direction is
// a face of the cube around it and a place there; cells of both are numbered along Morton curves, the
// coarse bits of both in the first number of the key, the fine ones in the second. Empty rays go last.

#include "common/precision.glsl"
#include <streams>
#include "common/stream.glsl"

uniform ivec2 ray_texture_size;

const int EMPTY = 1 << 23;

// Bits two and three places apart, of up to 8 bits.
ivec2 spread_2(ivec2 v) {
    v = (v | v << 4) & 0x0f0f;
    v = (v | v << 2) & 0x3333;
    return (v | v << 1) & 0x5555;
}

ivec3 spread_3(ivec3 v) {
    v = (v | v << 8) & 0x00f00f;
    v = (v | v << 4) & 0x0c30c3;
    return (v | v << 2) & 0x249249;
}

int interleave(ivec2 v) {
    v = spread_2(v);
    return v.x << 1 | v.y;
}

int interleave(ivec3 v) {
    v = spread_3(v);
    return v.x << 2 | v.y << 1 | v.z;
}

// 0 to 2^bits - 1 along each axis; an extent of nothing, or so little that its inverse overflows, has
// one cell. The clamp is for origins on the box's upper faces.
ivec3 origin_cell(vec3 origin, vec3 lo, vec3 hi, int bits) {
    vec3 per_unit = float(1 << bits) / (hi - lo);
    vec3 place = (origin - lo) * per_unit;
    ivec3 cell = clamp(ivec3(place), 0, (1 << bits) - 1);
    bvec3 none = lessThan(vec3(3e38), per_unit);
    return ivec3(none.x ? 0 : cell.x, none.y ? 0 : cell.y, none.z ? 0 : cell.z);
}

// The face 0 to 5 of the cube that a direction goes through; where two components are equal, the
// first owns it. The place on it, 0 to 2^bits - 1.
int direction_face(vec3 d, int bits, out ivec2 place) {
    vec3 size = abs(d);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    vec3 turned = axis == 0 ? d.xyz : axis == 1 ? d.yzx : d.zxy;
    vec2 at = turned.yz / abs(turned.x) * 0.5 + 0.5;
    place = clamp(ivec2(at * float(1 << bits)), 0, (1 << bits) - 1);
    return 2 * axis + (turned.x < 0.0 ? 1 : 0);
}

void main() {
    int i = element();
    Rays ray = rays_load(ivec2(i % ray_texture_size.x, i / ray_texture_size.x));
    vec3 lo = low_load(ivec2(0)).value.xyz;
    vec3 hi = -high_load(ivec2(0)).value.xyz;
    ivec3 cell = origin_cell(ray.origin, lo, hi, ORIGIN_COARSE + ORIGIN_FINE);
    ivec2 place;
    int face = direction_face(ray.direction, DIRECTION_COARSE + DIRECTION_FINE, place);
    int first = (interleave(cell >> ORIGIN_FINE) << (3 + 2 * DIRECTION_COARSE))
              | face << (2 * DIRECTION_COARSE) | interleave(place >> DIRECTION_FINE);
    int second = interleave(cell & ((1 << ORIGIN_FINE) - 1)) << (2 * DIRECTION_FINE)
               | interleave(place & ((1 << DIRECTION_FINE) - 1));
    bool empty = !(ray.t_min <= ray.t_max);
    sort_key_store(Sort_key(empty ? EMPTY : first, empty ? 0 : second, i));
}
