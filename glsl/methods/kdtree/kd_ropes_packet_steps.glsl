// kd-ropes-packet under the schedule `step`. A ray's place in the tree is its own node and its t_min. The
// packet's node is the node of the ray with the smallest t_min. packet_steps.glsl and packet_ray.glsl
// describe the functions.

#include "methods/kdtree/packet_steps.glsl"

void clear_packet() {
}

void load_packet() {
    axis = kd_node_axis(node);
    left = kd_node_left(node);
}

void store_packet() {
}

void load_ray(int r) {
    State own = state_load(own_texel(r));
    start_ray(r);
    t_min[r] = own.t_min;
    ray_node[r] = rays[r].t_min <= rays[r].t_max ? own.ray_node : SETTLED;
    t_turn[r] = turn_has_begun(r) ? NEVER : t_turn[r];
}

void store_ray(inout State own) {
    own.t_min = t_min[0];
    own.ray_node = ray_node[0];
}

// Kernels ----------------------------------------------------------------------------------------

void traverse() {
    if (axis < LEAF) {
        find_t_front();
        enter();
    } else {
        visit_leaf(left, kd_node_count(node));
    }
}

void repeat_traverse() {
    if (axis < LEAF) {
        enter();
    }
}

void repeat_leave() {
    leave_leaf();
}
