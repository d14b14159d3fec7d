// kd-short-stack in the era form (docs/era.md): the search of kd_short_stack.glsl, with a state that needs
// three of a card's four render targets. Three rules keep the state small, without extra instructions:
//   1. In a leaf, `place` holds the cursor (the position in the leaf's list) instead of the node; t_min
//      holds the list's end. This is possible because leave_leaf() sets node and t_min anew.
//   2. No stack holds the root (node 0), so 0 marks a free entry, and no field counts the entries.
//   3. The flag `pushing` of kd_short_stack.glsl is set only while the stack is empty. The node PUSHING in
//      the stack's first entry represents this flag.

#define node place      // in a leaf, this field holds the cursor
#define cursor place
#define end t_min       // in a leaf, this field holds the end of the leaf's list

#include "methods/kdtree/kd_common.glsl"

const float FREE = 0.0;
const float PUSHING = -1.0;

void start_search(inout State state) {
    state.pushed = state.node;
    state.stack_node = vec3(PUSHING, FREE, FREE);
    state.stack_t_max = vec3(0.0);
}

void take_only_child(inout State state) {
#ifdef PUSH_DOWN
    state.pushed = state.stack_node.x == PUSHING ? state.node : state.pushed;
#endif
}

void pass_far_child(float far, float t_max, inout State state) {
    vec2 below = vec2(max(state.stack_node.x, FREE), state.stack_node.y);
    state.stack_node = vec3(far, STACK_SIZE > 1 ? below.x : FREE, STACK_SIZE > 2 ? below.y : FREE);
    state.stack_t_max = vec3(t_max, state.stack_t_max.xy);
}

void leave_leaf(inout State state, Hit hit) {
    if (is_settled(state, hit)) {
        settle(state, hit);
    } else if (state.stack_node.x > FREE) {
        state.t_min = resumed(state.t_max);
        state.t_max = state.stack_t_max.x;
        state.node = state.stack_node.x;
        state.stack_t_max.xy = state.stack_t_max.yz;
        state.stack_node = vec3(state.stack_node.yz, FREE);
        state.phase = DOWN;
    } else {
        search_rest(state.pushed, state);
        state.stack_node.x = PUSHING;
    }
}
