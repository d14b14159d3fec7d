#version 330 core
// Computes the boxes of the nodes that span `run` to 4 * run - 1 slots (places in the triangle order).
// Four runs (box_runs.frag) of `run` slots cover a node. Where runs overlap, minimum and maximum do not
// change. Passes with other values of `run` compute the boxes of the other nodes.

#include <records>
#include "core/stream.glsl"

uniform int run;

void main() {
    Interval node = interval_load(table_texel(element()));
    int length = node.last - node.first + 1;
    if (node.first < 0 || length < run || length >= 4 * run) {
        discard;
    }
    Box box = box_load(table_texel(node.first));
    for (int k = 1; k < 4; ++k) {
        Box other = box_load(table_texel(min(node.first + k * run, node.last + 1 - run)));
        box = Box(min(box.lo, other.lo), max(box.hi, other.hi));
    }
    node_box_store(Node_box(box.lo, box.hi));
}
