// A ray begins its search at the root of the kd-tree. The counterpart of kd_entries.glsl.

#define BEGIN DOWN

void begin_entries(inout State state) {
}

const int ROOT = 0;

// The node at which a restart begins.
int root_of(State state) {
    return ROOT;
}

// End a search that is settled.
void settle(inout State state, Hit hit) {
    state.phase = DONE;
}
