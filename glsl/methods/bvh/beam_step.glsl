// Advances a beam by one node of a threaded BVH. A beam bounds neighbouring rays. It skips a node that it
// misses. It descends into an inner node if about half of the beam's rays or more meet the node. It never
// descends into a portal, the link to a subtree that octants share (bvh_nodes.glsl). Every other node
// becomes an entry, at which the rays of the beam begin their own search.

#include "core/quantised.glsl"
#include "methods/bvh/bvh_nodes.glsl"

uniform int node_count;

bool goes_on(Tile_beam beam, int node, out int next, out int escape) {
    vec3 a = bvh_node_lo(node);
    vec3 b = bvh_node_hi(node);
    Beam_interval interval = beam_interval(beam, min(a, b), max(a, b));
    escape = bvh_node_escape(node);
    bool down = is_met(interval) && by_most(interval) && bvh_node_first(node) == -1;
    next = down ? node + 1 : escape;
    return down || !is_met(interval);
}
