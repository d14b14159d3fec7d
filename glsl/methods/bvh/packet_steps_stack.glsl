// Advances a packet under the schedule `step`, in a walk with a stack. The stack lies in the tiles of an
// atlas (drivers/push.frag), and PUSH and POP are separate phases. packet_steps.glsl describes the
// functions.

#include "core/tiles.glsl"
#include "methods/bvh/packet_steps.glsl"

void clear_place() {
    packet.far = 0;
    packet.far_t_max = 0.0;
}

void load_place() {
    stacked = packet.stacked;
}

void store_place() {
    packet.stacked = stacked;
}

void go_on() {
    if (node == NOTHING && stacked == 0) {
        end_walk();
    } else {
        packet.phase = node == NOTHING ? POP : is_leaf(node) ? INTERSECT : TRAVERSE;
        packet.cursor = first_triangle(node);
    }
}

// A visit of an inner node tests the boxes of its children. If the root is a leaf, skip the visit and begin
// the leaf.
void traverse() {
    packet.far = NOTHING;
    if (!is_leaf(node)) {
        packet.far = visit();
    }
    go_on();
    if (packet.far != NOTHING) {
        packet.phase = PUSH;
    }
}

void leave_leaf() {
    node = NOTHING;
    go_on();
}

void push() {
    ++stacked;
    go_on();
}

void pop() {
    --stacked;
    node = stack_entry_load(tile_corner(stacked) + ivec2(gl_FragCoord.xy)).node;
    go_on();
}
