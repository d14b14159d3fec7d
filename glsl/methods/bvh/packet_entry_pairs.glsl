// Finds the entry of packets in a BVH whose nodes hold the boxes of both children, after Reshetov et al.
// 2005 (see stages/packet_entries.frag). A beam bounds the rays of a tile. The beam descends into the
// nearer child as long as about half of the rays or more meet this child. It pushes each farther child that
// it meets, and pops a node if it misses both children. The packets of the tile start at the node that the
// beam reached, with the beam's stack.

#include "core/quantised.glsl"
#include "methods/bvh/bvh_pairs.glsl"

const int LINKS = 4;

void enter(Tile_beam beam, inout Packet_entry entry) {
    int links[LINKS] = int[](NO_LINK, NO_LINK, NO_LINK, NO_LINK);
    int stacked = 0;
    int node = root;
    bool on = !is_leaf(root);
    bool nothing = false;
    while (on && entry.visited < MOST_VISITS) {
        ++entry.visited;
        Beam_interval left = beam_interval(beam, bvh_pair_left_lo(node), bvh_pair_left_hi(node));
        Beam_interval right = beam_interval(beam, bvh_pair_right_lo(node), bvh_pair_right_hi(node));
        bool both = is_met(left) && is_met(right);
        bool left_first = is_met(left) && (!is_met(right) || left.outer.x <= right.outer.x);
        int near = left_first ? bvh_pair_left(node) : bvh_pair_right(node);
        int far = left_first ? bvh_pair_right(node) : bvh_pair_left(node);
        bool met = is_met(left) || is_met(right);
        bool mostly = left_first ? by_most(left) : by_most(right);
        bool back = !met && stacked > 0;
        nothing = !met && stacked == 0;
        on = back || (met && mostly && !is_leaf(near) && (stacked < LINKS || !both));
        stacked -= back ? 1 : 0;
        for (int k = 0; k < LINKS; ++k) {
            bool top = k == stacked;
            node = back && top ? links[k] : node;
            links[k] = back && top ? NO_LINK : on && both && top ? far : links[k];
        }
        stacked += on && both ? 1 : 0;
        node = on && met ? near : node;
        on = on && !is_leaf(node);
    }
#ifdef BOUNDED
    entry.met = nothing ? 0 : 1;
#endif
    entry.start = node;
    entry.link_1 = links[0];
    entry.link_2 = links[1];
    entry.link_3 = links[2];
    entry.link_4 = links[3];
}
