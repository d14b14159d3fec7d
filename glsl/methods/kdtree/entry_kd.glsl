// Finds the entry points of a tile of rays in a kd-tree, after Reshetov et al. 2005 (see
// stages/entry_points.frag). A beam bounds the rays of the tile and descends front to back. A non-empty
// leaf becomes an entry if the beam meets the leaf's box. The beam does not descend into an inner node in
// three cases: fewer than about half of its rays meet the node's box, the list has no place for both
// children, or the beam has visited MOST_VISITS nodes. Such a node becomes an entry if the beam meets its
// box. Empty leaves are skipped; the paper builds trees with large empty leaves.
//
// Departure: a tile has a list of nodes in the order of the walk; a tile of the paper has one node. Rays
// skip the space between the subtrees of the list. Each node on the stack reserves a place in the list, so
// the list never overflows.

#include "core/axis.glsl"

int stack[ENTRIES];
int stacked = 0;

void push(int node) {
    for (int i = 0; i < ENTRIES; ++i) {   // not stack[stacked]: see `emit` in stages/entry_points.frag
        stack[i] = i == stacked ? node : stack[i];
    }
    ++stacked;
}

void walk(Tile_beam beam, ivec2 tile) {
    Beam_interval scene = beam_interval(beam, scene_lo, scene_hi);
    if (scene.outer.x > scene.outer.y) {
        return;
    }
    if (is_mixed(beam.signs)) {   // no order of the children suits all rays
        emit(WHOLE_TREE);
        return;
    }
#ifdef UPPER
    for (int i = ENTRIES - 1; i >= 0; --i) {   // push the first entry last, so that it is on top
        int code = entry_code(tile / FAN, i);
        if (code != LIST_END) {
            push(entry_node(code, 0));
        }
    }
#else
    push(0);
#endif
    while (stacked > 0) {
        --stacked;
        int node = stack[stacked];
        int axis = kd_node_axis(node);
        int left = kd_node_left(node);
        int count = kd_node_count(node);
        ++visited;
        Beam_interval interval = beam_interval(beam, kd_bounds_lo(node), kd_bounds_hi(node));
        bool met = is_met(interval) && (axis < LEAF || count > 0);
        bool room = entries + stacked + 2 <= ENTRIES && visited < MOST_VISITS;
        if (met && axis < LEAF && by_most(interval) && room) {
            int negative = (beam.signs >> axis) & 1;
            int near = left + negative;
            int far = left + 1 - negative;
            if ((count & (2 - negative)) == 0) {
                push(far);
            }
            if ((count & (1 + negative)) == 0) {
                push(near);
            }
        } else if (met) {
            emit(node);
        }
    }
}
