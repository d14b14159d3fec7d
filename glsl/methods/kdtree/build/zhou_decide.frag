#version 330 core
// Decides the split of a large node. If empty space on one side exceeds the share `empty_cut` of the node's
// extent, the split cuts this space off. Otherwise the split halves the node along its longest axis, or
// along another axis if the plane across the longest axis separates no pieces (zhou.glsl). Axis 3 marks a
// node that this pass does not split: a leaf, or a small node, which later passes may split.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int small;
uniform float empty_cut;
uniform int most_futile;
uniform bool stop;

void main() {
    int i = element();
    Cell cell = cell_load(table_texel(i));
    Decision decision = Decision(0.0, 3, cell.futile);
    if (cell.count <= small || stop) {
        decision_store(decision);
        return;
    }
    int first = int(starts_load(table_texel(i)).value.w);
    int end = int(starts_load(table_texel(i + 1)).value.w);
    Chunk whole = chunk_load(table_texel(first));
    for (int c = first + 1; c < end; ++c) {
        Chunk chunk = chunk_load(table_texel(c));
        whole.lo = min(whole.lo, chunk.lo);
        whole.hi = max(whole.hi, chunk.hi);
        whole.left += chunk.left;
        whole.right += chunk.right;
    }
    PRECISE vec3 extent = cell.hi - cell.lo;
    PRECISE vec3 below = (whole.lo - cell.lo) / extent;
    PRECISE vec3 above = (cell.hi - whole.hi) / extent;
    int axis = 0;
    float gap = -INFINITY, plane = 0.0;
    for (int side = 0; side < 6; ++side) {
        int a = side % 3;
        float share = side < 3 ? below[a] : above[a];
        if (share > gap) {
            gap = share;
            axis = a;
            plane = side < 3 ? whole.lo[a] : whole.hi[a];
        }
    }
    if (gap > empty_cut && plane > cell.lo[axis] && plane < cell.hi[axis]) {
        decision_store(Decision(plane, axis, cell.futile));
        return;
    }
    PRECISE vec3 middle = cell.lo + 0.5 * extent;
    float none = 2.0 * float(cell.count);   // left + right if the plane separates no pieces
    vec3 both = whole.left + whole.right;
    int longest = 0, least = 0;
    for (int a = 0; a < 3; ++a) {
        if (!(middle[a] > cell.lo[a] && middle[a] < cell.hi[a])) {
            both[a] = none + 1.0;
        }
        longest = extent[a] > extent[longest] ? a : longest;
        least = both[a] < both[least] ? a : least;
    }
    int chosen = both[longest] < none ? longest : least;
    int futile = both[chosen] < none ? 0 : cell.futile + 1;
    bool inner = both[chosen] <= none && futile <= most_futile;
    decision_store(Decision(middle[chosen], inner ? chosen : 3, futile));
}
