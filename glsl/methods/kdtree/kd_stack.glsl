// kd-stack: each ray has a full stack in a local array, which CUDA made possible. Sources: Budge, Anderson,
// Garth, Joy, "A Hybrid CPU-GPU Implementation for Interactive Ray-Tracing of Dynamic Scenes", technical
// report CSE-2008-9 of UC Davis, and Zhou, Hou, Wang, Guo, "Real-time KD-tree construction on graphics
// hardware", SIGGRAPH Asia 2008 (survey, section 3.4). By default STACK_SIZE is at least the depth of the
// tree. With a smaller stack, a ray stops at an overflow and is flagged.
//
// The array exists for one pass only. If the renderer's limit on loops makes a second pass necessary, the
// ray continues at its current node with an empty stack. If the stack is empty when the ray leaves a leaf,
// the ray restarts at the root with the rest of its interval.

#include "methods/kdtree/kd_common.glsl"

int stacked = 0;
int stack_node[STACK_SIZE + 1];
float stack_t_max[STACK_SIZE + 1];

void start_search(inout State state) {
    stacked = 0;
}

void take_only_child(inout State state) {
}

void pass_far_child(int far, float t_max, inout State state) {
    stack_node[stacked] = far;
    stack_t_max[stacked] = t_max;
    ++stacked;
    if (stacked > STACK_SIZE) {
        state.phase = OVERFLOWN;
    }
}

void leave_leaf(inout State state, Hit hit) {
    if (is_settled(state, hit)) {
        settle(state, hit);
    } else if (stacked > 0) {
        --stacked;
        state.t_min = resumed(state.t_max);
        state.t_max = stack_t_max[stacked];
        state.node = stack_node[stacked];
        state.phase = DOWN;
    } else {
        search_rest(root_of(state), state);
    }
}
