#version 330 core
// Writes a node of the finished tree in the format that the kd methods read. In a leaf, the field for the
// left child holds the index of the first reference.

#include <records>
#include "core/stream.glsl"

void main() {
    ivec2 texel = table_texel(element());
    Built built = built_load(texel);
    int left = built.axis == 3 ? int(sums_load(texel).value.x) : built.left;
    kd_node_store(Kd_node(built.split, built.axis, left, built.count));
}
