// A kd packet without a stack (`stack_size=0`): it restarts whenever it has left a leaf.

void clear_stack() {
}

void push(int far) {
}

void pop_awake() {
}
