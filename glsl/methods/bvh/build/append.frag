#version 330 core
// Nodes of a level at their place among those of all levels.

#include <records>
#include "core/stream.glsl"

uniform int base;

void main() {
    Level node = level_load(table_texel(element() - base));
    interval_store(Interval(node.first, node.last, node.parent, node.turns));
}
