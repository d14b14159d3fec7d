// A kd packet without a stack (`stack_size=0`). The packet restarts after each leaf.

void clear_stack() {
}

void push(int far) {
}

void pop_awake() {
}
