#version 330 core
// How a node of the upper levels of a hybrid kd-tree is split: it is a prefix of Morton codes, and the
// lattice's plane halves it along x, y and z in turn (C. Lauterbach et al. 2009, carried over to the
// kd-tree as the survey's section 5 proposes). No cost is asked for. Where nothing is there is a leaf.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int level;      // how deep the node lies
uniform int bits;       // of an axis in a code

void main() {
    int i = element();
    Cell cell = cell_load(table_texel(i));
    int coordinate = 0;     // of the node along the axis of its depth, x first in the code
    for (int bit = level % 3; bit < level; bit += 3) {
        coordinate = coordinate << 1 | cell.futile >> (level - 1 - bit) & 1;
    }
    int middle = (2 * coordinate + 1) << (bits - level / 3 - 1);
    float plane = planes_load(table_texel(middle)).value[level % 3];
    decision_store(Decision(plane, cell.count > 0 ? level % 3 : 3, cell.futile));
}
