#version 330 core
// Computes masks for the lower and the upper face of a piece (zhou.glsl) along an axis. The masks mark the
// pieces of a small root that lie left and right of the face. A small root is a small node whose parent is
// large. All nodes below this root use the masks.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

void main() {
    int i = element();
    int axis = i % 3;
    Node root = node_load(table_texel(piece_load(table_texel(i / 3)).node));
    int count = population(mask_bits(root.mask));
    Extent own = extent_load(table_texel(i));
    Sides sides = Sides(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    for (int bit = 0; bit < count; ++bit) {
        Extent other = extent_load(table_texel(3 * (root.base + bit) + axis));
        vec4 one = vec4(equal(ivec4(bit >> 4), ivec4(0, 1, 2, 3))) * float(1 << (bit & 15));
        sides.lower_left += other.lo < own.lo || other.hi <= own.lo ? one : vec4(0.0);
        sides.lower_right += other.hi > own.lo ? one : vec4(0.0);
        sides.upper_left += other.lo < own.hi || other.hi <= own.hi ? one : vec4(0.0);
        sides.upper_right += other.hi > own.hi ? one : vec4(0.0);
    }
    sides_store(sides);
}
