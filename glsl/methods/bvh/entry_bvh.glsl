// Finds the entry points of a tile of rays in a threaded BVH, after Reshetov et al. 2005 (see
// stages/entry_points.frag). A beam bounds the rays of the tile and descends into the nodes that it meets.
// Three kinds of these nodes become entries instead: leaves, portals (links to shared subtrees), and nodes
// that fewer than about half of the beam's rays meet. If the list is full, or the beam has visited
// MOST_VISITS nodes, the last entry represents the whole rest of the walk.
//
// Departure: a tile has a list of nodes; the paper's tile has one node. In a BVH, a single node for all
// rays of a tile would often be the root.

#include "methods/bvh/beam_step.glsl"

void walk(Tile_beam beam, ivec2 tile) {
#ifdef OCTANTS
    if (is_mixed(beam.signs)) {
        emit(WHOLE_TREE);
        return;
    }
    int root = node_count * octant_of(beam.signs);
#else
    int root = 0;
#endif
    int node = node_count > 0 ? root : -1;
    int end = -1;
    bool begins = false;   // whether `node` is a subtree's root, whose escape index ends the subtree
    int above = 0;
#ifdef UPPER
    node = -1;
#endif
    bool on = node_count > 0;
    while (on) {
#ifdef UPPER
        if (node == end) {
            int code = entry_code(tile / FAN, above);
            ++above;
            on = code != LIST_END;
            node = on ? entry_node(code, root) : -1;
            end = -1;
            begins = on && !is_rest(code);
            above = is_rest(code) ? ENTRIES : above;
        }
#endif
        if (on && (entries == ENTRIES - 1 || visited >= MOST_VISITS)) {
            emit(rest_from(node));
            on = false;
        }
        if (on) {
            ++visited;
            int next;
            int escape;
            bool past = goes_on(beam, node, next, escape);
            end = begins ? escape : end;
            begins = false;
            if (!past) {
                emit(node);
            }
            node = next;
#ifndef UPPER
            on = node != -1;
#endif
        }
    }
}
