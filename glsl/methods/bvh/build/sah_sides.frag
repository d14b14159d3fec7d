#version 330 core
// Flags the slots (positions in the order of the triangles) whose triangles go to the right child.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/middle.glsl"
#include "methods/bvh/build/sah.glsl"
#include "methods/bvh/build/large.glsl"

float place_of(int slot, int axis) {
    return middle_of(box_load(table_texel(slot_load(table_texel(slot)).triangle)))[axis];
}

void main() {
    int i = element();
    int number = slot_load(table_texel(i)).node;
    bool right = false;
    if (number >= 0) {
        Split split = split_load(table_texel(number));
        if (split.axis == IN_ORDER) {
            right = i >= split.at;
        } else if (is_large(interval_load(table_texel(number)))) {
            right = values_load(table_texel(i)).value[split.axis] > float(split.at);
        } else {
            float here = place_of(i, split.axis), there = place_of(split.at, split.axis);
            right = here > there || (here == there && i > split.at);
        }
    }
    side_store(Side(vec4(float(right))));
}
