// Stores the short stack of a kd packet between passes. The packet's state holds the nodes, and each ray's
// state holds the ray's t_max in each node. No stack holds the root, so node 0 marks a free entry. The
// field `popped` counts the entries that the last kernel popped.

int entries(ivec4 nodes) {
    ivec4 used = ivec4(notEqual(nodes, ivec4(0)));
    return used.x + used.y + used.z + used.w;
}

void clear_packet_stack() {
    packet.popped = 0;
    packet.stack_node = ivec4(0);
}

void load_packet_stack() {
    stacked = entries(packet.stack_node);
    for (int k = 0; k < STACK_SIZE; ++k) {
        stack_node[k] = packet.stack_node[k];
    }
}

void store_packet_stack() {
    packet.popped = max(entries(packet.stack_node) - stacked, 0);
    for (int k = 0; k < STACK_SIZE; ++k) {
        packet.stack_node[k] = k < stacked ? stack_node[k] : 0;
    }
}

void load_ray_stack(int r, State own) {
    for (int k = 0; k < STACK_SIZE; ++k) {
        stack_t_max[k * RAYS + r] = own.stack_t_max[k];
    }
}

void store_ray_stack(inout State own) {
    own.stack_t_max = vec4(0.0);
    for (int k = 0; k < STACK_SIZE; ++k) {
        own.stack_t_max[k] = packet.stack_node[k] != 0 ? stack_t_max[k] : 0.0;
    }
}

void repeat_pops() {
    for (int k = 0; k < packet.popped; ++k) {
        pop();
    }
}
