// kd-restart: Foley and Sugerman 2005, section 4 (survey, section 3.4, Figure 11 left). A ray that leaves a
// leaf without a hit restarts at the root with the rest of its interval.

#include "methods/kdtree/kd_common.glsl"

void start_search(inout State state) {
}

void take_only_child(inout State state) {
}

void pass_far_child(pointer far, float t_max, inout State state) {
}

void leave_leaf(inout State state, Hit hit) {
    if (is_settled(state, hit)) {
        settle(state, hit);
    } else {
        search_rest(root_of(state), state);
    }
}
