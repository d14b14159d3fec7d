#version 330 core
// Writes the nodes of the next level: two children for each split node.

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    int parent = source_load(table_texel(i >> 1)).index;
    Interval node = interval_load(table_texel(parent));
    int taken = split_load(table_texel(parent)).taken;
    bool left = (i & 1) == 0;
    interval_store(Interval(left ? node.first : node.first + taken,
                            left ? node.first + taken - 1 : node.last, -1,
                            node.turns + int(left)));
}
