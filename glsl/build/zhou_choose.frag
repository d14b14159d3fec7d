#version 330 core
// The cheapest plane of a small node by the surface area heuristic, among the faces of the boxes of
// its pieces. The twin of SplitCost in gpgpu_rt/accel/sah.py.

#include <records>
#include "common/stream.glsl"
#include "build/zhou.glsl"

uniform float traversal_cost;
uniform float intersection_cost;
uniform float spared;           // what a split costs that cuts off empty space, as a share
uniform float worth_cutting;

// Of one node, for splits across each axis.
vec3 cap, rim, per_unit;

void measure(Node node) {
    PRECISE vec3 size = node.hi - node.lo;
    per_unit = 1.0 / size;
    size = size / max(max(size.x, size.y), size.z);
    PRECISE vec3 sides = size * (size.yzx + size.zxy);
    PRECISE vec3 face = size.yzx * size.zxy;
    PRECISE vec3 scale = intersection_cost / (sides + face);
    cap = scale * face;
    rim = scale * sides;
}

float split_cost(Node node, int axis, float plane, float left, float right) {
    PRECISE float share = (plane - node.lo[axis]) * per_unit[axis];
    PRECISE float cost = cap[axis] * (left + right);
    PRECISE float within = share * left + (1.0 - share) * right;
    PRECISE float rest = rim[axis] * within;
    cost = cost + rest;
    cost = cost + traversal_cost;
    bool empty = (left == 0.0 && share >= worth_cutting)
        || (right == 0.0 && share <= 1.0 - worth_cutting);
    cost = empty ? cost * spared : cost;
    return plane > node.lo[axis] && plane < node.hi[axis] ? cost : INFINITY;
}

float held(uvec2 mask, vec4 side) {
    return float(population(mask & mask_bits(side)));
}

void main() {
    Node node = node_load(table_texel(element()));
    measure(node);
    float cheapest = INFINITY;
    Choice choice = Choice(0.0, 1 << 20, 0, 0);
    uvec2 mask = mask_bits(node.mask), rest = mask;
    while (rest != uvec2(0u)) {
        int bit = take_bit(rest);
        for (int axis = 0; axis < 3; ++axis) {
            int i = 3 * (node.base + bit) + axis;
            Sides sides = sides_load(table_texel(i));
            Extent extent = extent_load(table_texel(i));
            float lower = split_cost(node, axis, extent.lo,
                                     held(mask, sides.lower_left),
                                     held(mask, sides.lower_right));
            float upper = split_cost(node, axis, extent.hi,
                                     held(mask, sides.upper_left),
                                     held(mask, sides.upper_right));
            // Of equal costs the first in the order of pieces, and of lower before upper faces.
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
