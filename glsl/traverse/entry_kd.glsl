// Entry points of a kd-tree, after Reshetov, Soupikov, Hurley, "Multi-Level Ray Tracing Algorithm",
// SIGGRAPH 2005 (fact sheet F2; see passes/entry_points.frag). The beam goes down front to back and
// leaves as entries the leaves with triangles that it meets, and the nodes that about half of its rays
// miss. Leaves without triangles are left out, which is what the paper's trees are built for.
//
// Departure: a list, in the order of the way, in the place of the paper's one node: what lies between
// its subtrees no ray visits. Every node on the stack has a place in the list kept for it, so none
// overflows.

#include "common/kd_leaf.glsl"

void walk(Tile_beam beam, ivec2 tile) {
    Beam_interval scene = beam_interval(beam, scene_lo, scene_hi);
    if (scene.outer.x > scene.outer.y) {
        return;
    }
    if (is_mixed(beam.signs)) {   // no order is all rays'
        emit(WHOLE_TREE);
        return;
    }
    int stack[ENTRIES];
    int stacked = 0;
#ifdef UPPER
    for (int i = 0; i < ENTRIES; ++i) {
        stacked += entry_code(tile / FAN, i) != LIST_END ? 1 : 0;
    }
    for (int i = 0; i < stacked; ++i) {
        stack[stacked - 1 - i] = entry_node(entry_code(tile / FAN, i), 0);
    }
#else
    stack[0] = 0;
    stacked = 1;
#endif
    while (stacked > 0) {
        --stacked;
        int node = stack[stacked];
        int axis = kd_node_axis(node);
        int left = kd_node_left(node);
        int count = kd_node_count(node);
        ++visited;
        Beam_interval interval = beam_interval(beam, kd_bounds_lo(node), kd_bounds_hi(node));
        bool met = !(interval.outer.x > interval.outer.y) && (axis < LEAF || count > 0);
        bool mostly = interval.core.x + interval.outer.x <= interval.core.y + interval.outer.y;
        bool room = entries + stacked + 2 <= ENTRIES && visited < MOST_VISITS;
        if (met && axis < LEAF && mostly && room) {
            int negative = (beam.signs >> axis) & 1;
            int near = left + negative;
            int far = left + 1 - negative;
            if ((count & (2 - negative)) == 0) {
                stack[stacked] = far;
                ++stacked;
            }
            if ((count & (1 + negative)) == 0) {
                stack[stacked] = near;
                ++stacked;
            }
        } else if (met) {
            emit(node);
        }
    }
}
