#version 330 core
// Copies the nodes of one level to their positions in the list of all nodes.

#include <records>
#include "core/stream.glsl"

uniform int base;

void main() {
    Level node = level_load(table_texel(element() - base));
    interval_store(Interval(node.first, node.last, node.parent, node.turns));
}
