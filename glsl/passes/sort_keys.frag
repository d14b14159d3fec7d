#version 330 core
// What rays are sorted by: a cell of the box that all origins lie in, and a cell of the directions.
// The survey proposes sorting rays (section 4.3; fact sheet I) and leaves the key open. A direction is
// a face of the cube around it and a place there. The key follows a Morton curve through both: bit by
// bit of each, coarse ones first, the face after those that cut space into a few parts. However many
// rays there are, as many bits of the key as tell them apart then part origins and directions alike.
// The first half of the levels is the first number of the key. Empty rays go last.

#include "common/precision.glsl"
#include <streams>
#include "common/stream.glsl"

uniform ivec2 ray_texture_size;

const int EMPTY = 1 << 23;

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
    ivec3 cell = origin_cell(ray.origin, lo, hi, LEVELS);
    ivec2 place;
    int face = direction_face(ray.direction, LEVELS, place);
    int words[2] = int[](0, 0);
    for (int level = 0; level < LEVELS; ++level) {
        int bit = LEVELS - 1 - level;
        int word = level < LEVELS / 2 ? 0 : 1;
        ivec3 o = cell >> bit & 1;
        words[word] = words[word] << 3 | o.x << 2 | o.y << 1 | o.z;
        if (level == FACE_LEVEL) {
            words[word] = words[word] << 3 | face;
        } else if (level > FACE_LEVEL) {
            ivec2 d = place >> (bit + 1 + FACE_LEVEL) & 1;
            words[word] = words[word] << 2 | d.x << 1 | d.y;
        }
    }
    bool empty = !(ray.t_min <= ray.t_max);
    sort_key_store(Sort_key(empty ? EMPTY : words[0], empty ? 0 : words[1], i));
}
