// Replaces packet_short_stack_steps.glsl: without a stack, there is nothing to store between passes.

void clear_packet_stack() {
}

void load_packet_stack() {
}

void store_packet_stack() {
}

void load_ray_stack(int r, State own) {
}

void store_ray_stack(inout State own) {
}

void repeat_pops() {
}
