// Finds the entry of packets in a threaded BVH, after Reshetov et al. 2005 (see
// stages/packet_entries.frag). A beam bounds the rays of a tile, and walks the tree in the order of the
// rays' octant. The beam stops at nodes that it meets but does not descend into
// (methods/bvh/beam_step.glsl). The entry holds the first of these nodes, and links to the next two.

#include "methods/bvh/beam_step.glsl"

const int JUMPS = 2;

void enter(Tile_beam beam, inout Packet_entry entry) {
    int node = node_count > 0 ? node_count * octant_of(beam.signs) : -1;
    int last = node;
    int found = 0;
    while (node != -1 && found <= JUMPS && entry.visited < MOST_VISITS) {
        int next;
        int escape;
        last = node;
        ++entry.visited;
        if (!goes_on(beam, node, next, escape)) {
            entry.start = found == 0 ? node : entry.start;
            entry.link_1 = found == 0 ? escape : entry.link_1;
            entry.link_2 = found == 1 ? node : entry.link_2;
            entry.link_3 = found == 1 ? escape : entry.link_3;
            entry.link_4 = found == 2 ? node : entry.link_4;
            ++found;
        }
        node = next;
    }
#ifdef BOUNDED
    entry.met = found > 0 || node != -1 ? 1 : 0;
#endif
    // If the beam has stopped at no node, start at the node that the beam would visit next. At the end of
    // the tree no such node exists. Then start at the last visited node: the rays miss this node, so one
    // visit ends the walk.
    entry.start = found > 0 || last == -1 ? entry.start : node == -1 ? last : node;
    entry.link_2 = found == 1 ? node : entry.link_2;
    entry.link_4 = found == 2 ? node : entry.link_4;
}
