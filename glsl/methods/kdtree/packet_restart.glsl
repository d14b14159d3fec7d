// Replaces packet_short_stack.glsl if `stack_size=0`: a packet restarts after each leaf.

void clear_stack() {
}

void push(int far) {
}

void pop_awake() {
}
