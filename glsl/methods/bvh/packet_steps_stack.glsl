// A packet's step under the schedule `step`, in a walk with a stack. The stack lies in the tiles of an
// atlas (drivers/push.frag), and PUSH and POP are phases of their own. The header of
// drivers/packet_visit.frag describes each function.

#include "core/tiles.glsl"

void clear_walk() {
    state.far = 0;
    state.far_t_max = 0.0;
}

void load_walk() {
    stacked = state.stacked;
}

void store_walk() {
    state.stacked = stacked;
}

void go_on() {
    if (node == NOTHING && stacked == 0) {
        end_walk();
    } else {
        state.phase = node == NOTHING ? POP : is_leaf(node) ? INTERSECT : TRAVERSE;
        state.cursor = first_triangle(node);
    }
}

// A visit of an inner node tests the boxes of its children. If the root is a leaf, skip the visit and go on
// to the leaf's triangles.
void traverse() {
    state.far = NOTHING;
    if (!is_leaf(node)) {
        state.far = visit();
    }
    go_on();
    if (state.far != NOTHING) {
        state.phase = PUSH;
    }
}

void leave_leaf() {
    node = NOTHING;
    go_on();
}

void run_stack() {
    if (state.phase == PUSH) {
        ++stacked;
        go_on();
    } else if (state.phase == POP) {
        --stacked;
        node = stack_entry_load(tile_corner(stacked) + ivec2(gl_FragCoord.xy)).node;
        go_on();
    }
}
