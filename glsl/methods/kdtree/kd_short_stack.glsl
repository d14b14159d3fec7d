// kd-short-stack: Horn, Sugerman, Houston, Hanrahan, "Interactive k-D Tree GPU Raytracing", I3D 2007
// (survey, section 3.4, Figure 13). A stack holds up to four far children. A push onto a full stack drops
// the lowest entry. A ray whose stack is empty restarts at the root, or, with PUSH_DOWN, at the deepest
// node that contains the unsearched part of the ray's interval (see kd_push_down.glsl).
//
// Departure: the entries shift through the components of a vector; the paper's stack is an array with a
// rotating base.

#include "methods/kdtree/kd_common.glsl"

void start_search(inout State state) {
    state.pushed = state.node;
    state.pushing = 1;
    state.stacked = 0;
    state.stack_t_max = vec4(0.0);
    state.stack_node = ivec4(0);
}

void take_only_child(inout State state) {
#ifdef PUSH_DOWN
    state.pushed = state.pushing != 0 ? state.node : state.pushed;
#endif
}

void pass_far_child(int far, float t_max, inout State state) {
    state.pushing = 0;
    state.stack_t_max = vec4(t_max, state.stack_t_max.xyz);
    state.stack_node = ivec4(far, state.stack_node.xyz);
    state.stacked = min(state.stacked + 1, STACK_SIZE);
}

// After a pop, `pushing` stays 0: the popped node does not contain the whole unsearched interval.
void leave_leaf(inout State state, Hit hit) {
    if (is_settled(state, hit)) {
        settle(state, hit);
    } else if (state.stacked > 0) {
        state.t_min = resumed(state.t_max);
        state.t_max = state.stack_t_max.x;
        state.node = state.stack_node.x;
        state.stack_t_max.xyz = state.stack_t_max.yzw;
        state.stack_node.xyz = state.stack_node.yzw;
        --state.stacked;
        state.phase = DOWN;
    } else {
        search_rest(state.pushed, state);
        state.pushing = 1;
    }
}
