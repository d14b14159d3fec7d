// Replaces kd_entries.glsl: a ray begins its search at the root of the kd-tree.

#define BEGIN DOWN

void begin_entries(inout State state) {
}

int root_of(State state) {
    int root = 0;
    return root;
}

// End a search that is settled: the ray has a hit before its leaf's end, or its interval is exhausted.
void settle(inout State state, Hit hit) {
    state.phase = DONE;
}
