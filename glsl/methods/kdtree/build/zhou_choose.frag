#version 330 core
// Chooses the cheapest plane of a small node by the surface area heuristic. The candidates are the faces of
// the boxes of the node's pieces (parts of triangles).

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"
#include "methods/kdtree/build/split_cost.glsl"

float held(uvec2 mask, vec4 side) {
    return float(population(mask & mask_bits(side)));
}

void main() {
    Node node = node_load(table_texel(element()));
    measure(node.lo, node.hi);
    float cheapest = INFINITY;
    Choice choice = Choice(0.0, 1 << 20, 0, 0);
    uvec2 mask = mask_bits(node.mask), rest = mask;
    while (rest != uvec2(0u)) {
        int bit = take_bit(rest);
        for (int axis = 0; axis < 3; ++axis) {
            int i = 3 * (node.base + bit) + axis;
            Sides sides = sides_load(table_texel(i));
            Extent extent = extent_load(table_texel(i));
            float lower = split_cost(axis, extent.lo,
                                     held(mask, sides.lower_left),
                                     held(mask, sides.lower_right));
            float upper = split_cost(axis, extent.hi,
                                     held(mask, sides.upper_left),
                                     held(mask, sides.upper_right));
            // At equal cost, choose the first piece, and lower faces before upper faces.
            int before = 6 * bit + axis;
            if (lower < cheapest || (lower == cheapest && before < choice.face)) {
                cheapest = lower;
                choice = Choice(extent.lo, before, i, 0);
            }
            if (upper < cheapest || (upper == cheapest && before + 3 < choice.face)) {
                cheapest = upper;
                choice = Choice(extent.hi, before + 3, i, 0);
            }
        }
    }
    choice.face = choice.face % 6;
    choice.inner = int(cheapest < intersection_cost * float(population(mask)) && node.levels > 0);
    choice_store(choice);
}
