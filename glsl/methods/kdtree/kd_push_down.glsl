// kd-push-down: Horn, Sugerman, Houston, Hanrahan, "Interactive k-D Tree GPU Raytracing", I3D 2007 (survey,
// section 3.4, Figure 13). As long as a descent needs only one child of each node, this child contains the
// whole rest of the ray's interval. A restart begins at the last such child, not at the root.
//
// Departure: each restart, not only the first descent, looks for such a child. This is safe: a node that
// contains the rest of the interval still contains the rest when the rest shrinks.

#include "methods/kdtree/kd_common.glsl"

void start_search(inout State state) {
    state.pushed = state.node;
    state.pushing = 1;
}

void take_only_child(inout State state) {
    state.pushed = state.pushing != 0 ? state.node : state.pushed;
}

void pass_far_child(pointer far, float t_max, inout State state) {
    state.pushing = 0;
}

void leave_leaf(inout State state, Hit hit) {
    if (is_settled(state, hit)) {
        settle(state, hit);
    } else {
        search_rest(state.pushed, state);
        state.pushing = 1;
    }
}
