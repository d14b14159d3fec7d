#version 330 core
// The boxes of nodes over `run` to 2 run - 1 slots: two runs of that length cover them, overlapping
// where they must, which changes no minimum and no maximum. Other nodes wait for their pass.

#include <records>
#include "common/stream.glsl"

uniform int run;

void main() {
    Interval node = interval_load(table_texel(element()));
    int length = node.last - node.first + 1;
    if (node.first < 0 || length < run || length >= 2 * run) {
        discard;
    }
    Box one = box_load(table_texel(node.first));
    Box two = box_load(table_texel(node.last + 1 - run));
    node_box_store(Node_box(min(one.lo, two.lo), max(one.hi, two.hi)));
}
