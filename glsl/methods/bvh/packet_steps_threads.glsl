// Advances a packet under the schedule `step`, in a walk along escape indices. packet_steps.glsl describes
// the functions.

#include "methods/bvh/packet_steps.glsl"

void clear_place() {
}

void load_place() {
#ifdef SHARED_SUBTREES
    after = packet.after;
#endif
}

void store_place() {
#ifdef SHARED_SUBTREES
    packet.after = after;
#endif
}

void go_on() {
    packet.phase = TRAVERSE;
    if (node < 0) {
        end_walk();
    }
}

void traverse() {
    int leaf = visit();
    if (leaf >= 0) {
        packet.phase = INTERSECT;
        packet.cursor = leaf;
    } else {
        go_on();
    }
}

void leave_leaf() {
    go_on();
}
