// Entry points of a threaded BVH, after Reshetov, Soupikov, Hurley, "Multi-Level Ray Tracing
// Algorithm", SIGGRAPH 2005 (see passes/entry_points.frag). The beam enters what it meets, as a ray
// does, and leaves as an entry each node that it meets and that is a leaf, or that about half of its
// rays miss. Where the list is full but for one entry, that one is all the rest of the walk.
//
// Departure: a list in the place of the paper's one node, which here would soon be the root.

#include "common/quantised.glsl"
#include "common/bvh_nodes.glsl"

uniform int node_count;

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
    bool begins = false;   // the next node is a subtree's, which ends where its escape index says
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
            int escape = bvh_node_escape(node);
            bool inner = bvh_node_first(node) < 0;
            vec3 a = bvh_node_lo(node);
            vec3 b = bvh_node_hi(node);
            end = begins ? escape : end;
            begins = false;
            Beam_interval interval = beam_interval(beam, min(a, b), max(a, b));
            bool met = !(interval.outer.x > interval.outer.y);
            bool mostly = interval.core.x + interval.outer.x <= interval.core.y + interval.outer.y;
            if (met && !(inner && mostly)) {
                emit(node);
            }
            node = met && inner && mostly ? node + 1 : escape;
#ifndef UPPER
            on = node != -1;
#endif
        }
    }
}
