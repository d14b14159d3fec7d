// Replaces kd_entries.glsl: a ray begins its search at the root of the kd-tree.

#define BEGIN DOWN

void begin_entries(inout State state) {
}

pointer root_of(State state) {
    pointer root = FIRST;
    return root;
}

// End a search that is settled: the ray has a hit before its leaf's end, or its interval is exhausted.
void settle(inout State state, Hit hit) {
    state.phase = DONE;
}
