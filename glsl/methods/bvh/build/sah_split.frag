#version 330 core
// Chooses the split of each node of the level, or makes the node a leaf.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/sah.glsl"
#include "methods/bvh/build/large.glsl"

uniform int level;
uniform int max_leaf;
uniform int max_depth;
uniform float traversal_cost;
uniform float intersection_cost;

void main() {
    int i = element();
    Interval node = interval_load(table_texel(i));
    int count = node.last - node.first + 1;
    float cost = FAR;
    Split split = Split(IN_ORDER, node.first + count / 2, count / 2);
    if (is_large(node)) {
        int rank = int(large_load(table_texel(i)).value.x);
        for (int axis = 0; axis < 3; ++axis) {
            vec4 offer = costs_load(table_texel(3 * rank + axis)).value;
            if (offer.x < cost) {
                cost = offer.x;
                split = Split(axis, int(offer.y), int(offer.z));
            }
        }
    } else {
        int uneven = count;
        for (int k = node.first; k <= node.last; ++k) {
            vec4 offer = sweep_load(table_texel(k)).value;
            int apart = abs(count - 2 * int(offer.z));
            // Among splits of equal cost (for example, if triangles coincide), choose the most even split.
            if (offer.x < cost || (offer.x == cost && offer.x < FAR && apart < uneven)) {
                cost = offer.x;
                uneven = apart;
                split = Split(int(offer.y), k, int(offer.z));
            }
        }
    }
    // Halve the node if any other split could exceed the maximum depth.
    int halvings = 0;
    while ((1 << halvings) < count) {
        ++halvings;
    }
    if (level + halvings >= max_depth) {
        split = Split(IN_ORDER, node.first + count / 2, count / 2);
    }
    bool leaf = count <= max_leaf && intersection_cost * float(count)
                                     <= 2.0 * traversal_cost + intersection_cost * cost;
    if (leaf || count < 2) {
        split.taken = 0;
    }
    split_store(split);
}
