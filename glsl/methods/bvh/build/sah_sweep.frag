#version 330 core
// Tries the splits of small nodes (at most SMALL triangles). Each slot (place in the triangle order)
// offers one split per axis, with the slot's triangle as the last triangle on the left side. The triangles
// are ordered by their box centres along the axis, and by slot if centres are equal. Writes the cost, the
// axis and the number of left triangles of the cheapest split.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/middle.glsl"
#include "methods/bvh/build/sah.glsl"
#include "methods/bvh/build/large.glsl"

void main() {
    int i = element();
    Slot slot = slot_load(table_texel(i));
    Interval node = interval_load(table_texel(max(slot.node, 0)));
    vec4 best = vec4(FAR, 0.0, 0.0, 0.0);
    if (slot.node >= 0 && !is_large(node)) {
        vec3 here = middle_of(box_load(table_texel(slot.triangle)));
        vec3 left_lo[3], left_hi[3], right_lo[3], right_hi[3];
        for (int axis = 0; axis < 3; ++axis) {
            left_lo[axis] = right_lo[axis] = vec3(FAR);
            left_hi[axis] = right_hi[axis] = vec3(-FAR);
        }
        vec3 taken = vec3(0.0);
        for (int k = node.first; k <= node.last; ++k) {
            Box box = box_load(table_texel(slot_load(table_texel(k)).triangle));
            vec3 middle = middle_of(box);
            for (int axis = 0; axis < 3; ++axis) {
                bool left = middle[axis] < here[axis] || (middle[axis] == here[axis] && k <= i);
                vec3 nothing_lo = vec3(FAR), nothing_hi = vec3(-FAR);
                left_lo[axis] = min(left_lo[axis], left ? box.lo : nothing_lo);
                left_hi[axis] = max(left_hi[axis], left ? box.hi : nothing_hi);
                right_lo[axis] = min(right_lo[axis], left ? nothing_lo : box.lo);
                right_hi[axis] = max(right_hi[axis], left ? nothing_hi : box.hi);
                taken[axis] += float(left);
            }
        }
        float count = float(node.last - node.first + 1);
        float whole = half_area(min(left_lo[0], right_lo[0]), max(left_hi[0], right_hi[0]));
        for (int axis = 0; axis < 3; ++axis) {
            float cost = split_cost(half_area(left_lo[axis], left_hi[axis]), taken[axis],
                                    half_area(right_lo[axis], right_hi[axis]),
                                    count - taken[axis], whole);
            if (taken[axis] < count && cost < best.x) {
                best = vec4(cost, axis, taken[axis], 0.0);
            }
        }
    }
    sweep_store(Sweep(best));
}
