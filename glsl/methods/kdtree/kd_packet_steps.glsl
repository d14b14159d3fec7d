// kd-packet under the schedule `step`. A ray's state holds the ray's interval, and the ray's t_max in each
// node on the packet's stack. The packet's state holds the current node, the nodes on the stack, and the
// node of a restart. The field `needed` is the vote of the rays: 1 if a ray needs the near child, plus 2 if
// a ray needs the far child. packet_steps.glsl and packet_ray.glsl describe the functions. An option
// chooses the file behind <stack_steps>.

#include "methods/kdtree/packet_steps.glsl"
#include <stack_steps>

void clear_packet() {
    packet.needed = packet.pushed = packet.pushing = 0;
    clear_packet_stack();
}

void load_packet() {
    pushed = packet.pushed;
    pushing = packet.pushing != 0;
    load_packet_stack();
}

void store_packet() {
    packet.pushed = pushed;
    packet.pushing = pushing ? 1 : 0;
    store_packet_stack();
}

void load_ray(int r) {
    State own = state_load(own_texel(r));
    start_ray(r);
    t_min[r] = rays[r].t_min <= rays[r].t_max ? own.t_min : NEVER;
    t_max[r] = own.t_max;
    t_turn[r] = turn_has_begun(r) || search_over(hits[r]) ? NEVER : t_turn[r];
    load_ray_stack(r, own);
}

void store_ray(inout State own) {
    own.t_min = t_min[0];
    own.t_max = t_max[0];
    store_ray_stack(own);
}

// Kernels ----------------------------------------------------------------------------------------

void traverse() {
    axis = kd_node_axis(node);
    int left = kd_node_left(node);
    int count = kd_node_count(node);
    if (axis < LEAF) {
        packet.phase = enter(left, count) ? TRAVERSE : LEAVE;
        packet.needed = (any_near ? 1 : 0) + (any_far ? 2 : 0);
        node = packet.needed != 0 ? node : packet.from;
    } else {
        visit_leaf(left, count);
    }
}

// Split the interval, and move on to the child that the packet has chosen.
void repeat_traverse() {
    axis = kd_node_axis(node);
    if (axis < LEAF) {
        plane = kd_node_split(node);
        order_children(kd_node_left(node), kd_node_count(node));
        split_ray(0);
        any_near = (packet.needed & 1) != 0;
        any_far = (packet.needed & 2) != 0;
        move_on();
    }
}

// Leave the leaf, and pop or restart as the packet did: `packet.pushing` is 1 after a restart, else 0.
void repeat_leave() {
    leave_ray(0);
    repeat_pops();
    if (packet.pushing != 0) {
        restart_ray(0);
    }
}
