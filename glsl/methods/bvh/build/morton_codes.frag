#version 330 core
// Computes the Morton code of each centroid: finds the centroid's cell in a lattice over all centroids, and
// interleaves the bits of the cell's coordinates, x first (C. Lauterbach et al., "Fast BVH Construction on
// GPUs", Eurographics 2009; survey, section 5).
//
// Departure: 30 bits do not fit into a float's significand, so a key consists of two numbers of 15 bits.
// Codes of fewer bits occupy the highest bits of the key, so no later pass depends on the number of bits.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/middle.glsl"

uniform int bits;   // per axis, 1 to 10

// Move bit k to position 3 * k, for five bits.
ivec3 spread(ivec3 v) {
    return (v & 1) | (v & 2) << 2 | (v & 4) << 4 | (v & 8) << 6 | (v & 16) << 8;
}

int interleave(ivec3 v) {
    v = spread(v);
    return v.x << 2 | v.y << 1 | v.z;
}

void main() {
    int i = element();
    vec3 low = low_load(ivec2(0)).value.xyz;
    PRECISE vec3 extent = high_load(ivec2(0)).value.xyz - low;
    float cells = float(1 << bits);
    PRECISE vec3 per_unit = cells / extent;
    PRECISE vec3 place = (middle_of(box_load(table_texel(i))) - low) * per_unit;
    // An axis has one cell if its extent is zero, or so small that the inverse overflows.
    bvec3 flat_ = lessThan(vec3(3e38), per_unit);
    ivec3 cell = clamp(ivec3(place), 0, (1 << bits) - 1) << (10 - bits);
    cell = ivec3(flat_.x ? 0 : cell.x, flat_.y ? 0 : cell.y, flat_.z ? 0 : cell.z);
    sort_key_store(Sort_key(interleave(cell >> 5), interleave(cell & 31), i));
}
