// Replaces packet_short_stack.glsl (`stack_size=0`): a kd packet restarts after each leaf.

void clear_stack() {
}

void push(int far) {
}

void pop_awake() {
}
