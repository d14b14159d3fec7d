#version 330 core
// Splits a node in the upper levels of a hybrid kd-tree. The node contains the cells of a lattice whose
// Morton codes begin with the same prefix. A lattice plane halves the node, without regard to SAH costs;
// the axes x, y and z alternate from level to level (C. Lauterbach et al. 2009; the survey's section 5
// proposes this method for the kd-tree). A node without pieces (zhou.glsl) becomes a leaf.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int level;      // depth of the node
uniform int bits;       // bits per axis in a code

void main() {
    int i = element();
    Cell cell = cell_load(table_texel(i));
    int coordinate = 0;     // the node's coordinate along the split axis; x comes first in a code
    for (int bit = level % 3; bit < level; bit += 3) {
        coordinate = coordinate << 1 | cell.futile >> (level - 1 - bit) & 1;
    }
    int middle = (2 * coordinate + 1) << (bits - level / 3 - 1);
    float plane = planes_load(table_texel(middle)).value[level % 3];
    decision_store(Decision(plane, cell.count > 0 ? level % 3 : 3, cell.futile));
}
