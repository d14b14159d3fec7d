#version 330 core
// Copies the nodes of a level to their position in the list of the nodes of all levels.

#include <records>
#include "core/stream.glsl"

uniform int base;

void main() {
    Level node = level_load(table_texel(element() - base));
    interval_store(Interval(node.first, node.last, node.parent, node.turns));
}
