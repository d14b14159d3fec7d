#version 330 core
// For a large node, finds the cheapest plane of one group of candidate planes (four along each axis).

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"
#include "methods/kdtree/build/split_cost.glsl"
#include "methods/kdtree/build/hybrid_planes.glsl"

void offer(inout Offer best, int axis, vec4 planes, vec4 left, vec4 right) {
    for (int k = 0; k < 4; ++k) {
        float cost = split_cost(axis, planes[k], left[k], right[k]);
        if (cost < best.cost) {
            best = Offer(planes[k], axis, cost);
        }
    }
}

void main() {
    int i = element() / GROUPS, group = element() % GROUPS;
    int first = int(starts_load(table_texel(i)).value.w);
    int end = int(starts_load(table_texel(i + 1)).value.w);
    Offer best = Offer(0.0, 3, INFINITY);
    if (first < end) {
        Tallies sum = Tallies(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
        for (int c = first; c < end; ++c) {
            Tallies part = tallies_load(table_texel(GROUPS * c + group));
            sum.left_x += part.left_x;
            sum.left_y += part.left_y;
            sum.left_z += part.left_z;
            sum.right_x += part.right_x;
            sum.right_y += part.right_y;
            sum.right_z += part.right_z;
        }
        Cell cell = cell_load(table_texel(i));
        Box box = box_load(table_texel(i));
        measure(cell.lo, cell.hi);
        offer(best, 0, group_planes(box, 0, group), sum.left_x, sum.right_x);
        offer(best, 1, group_planes(box, 1, group), sum.left_y, sum.right_y);
        offer(best, 2, group_planes(box, 2, group), sum.left_z, sum.right_z);
    }
    offer_store(best);
}
