#version 330 core
// A node of the finished tree in the format that kd methods read. A leaf names its first reference.

#include <records>
#include "core/stream.glsl"

void main() {
    ivec2 texel = table_texel(element());
    Built built = built_load(texel);
    int left = built.axis == 3 ? int(sums_load(texel).value.x) : built.left;
    kd_node_store(Kd_node(built.split, built.axis, left, built.count));
}
