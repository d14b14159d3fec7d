// A packet's step under the schedule `step`, in a walk along escape indices. The header of
// drivers/packet_visit.frag describes each function.

void clear_walk() {
}

void load_walk() {
#ifdef SHARED_SUBTREES
    after = state.after;
#endif
}

void store_walk() {
#ifdef SHARED_SUBTREES
    state.after = after;
#endif
}

void go_on() {
    state.phase = TRAVERSE;
    if (node < 0) {
        end_walk();
    }
}

void traverse() {
    int leaf = visit();
    if (leaf >= 0) {
        state.phase = INTERSECT;
        state.cursor = leaf;
    } else {
        go_on();
    }
}

void leave_leaf() {
    go_on();
}

void run_stack() {
}
