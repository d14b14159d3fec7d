// The short stack of a kd packet: a few far children, each with the t_max of every ray. A push
// onto a full stack drops the lowest entry.

int stacked;
int stack_node[STACK_SIZE];
float stack_t_max[STACK_SIZE * RAYS];

void clear_stack() {
    stacked = 0;
}

void push_ray(int r) {
    for (int k = STACK_SIZE - 1; k > 0; --k) {
        stack_t_max[k * RAYS + r] = stack_t_max[(k - 1) * RAYS + r];
    }
    stack_t_max[r] = t_max[r];
}

void push(int far) {
    EACH(push_ray)
    for (int k = STACK_SIZE - 1; k > 0; --k) {
        stack_node[k] = stack_node[k - 1];
    }
    stack_node[0] = far;
    stacked = min(stacked + 1, STACK_SIZE);
}

void pop_ray(int r) {
    t_max[r] = stack_t_max[r];
    for (int k = 1; k < STACK_SIZE; ++k) {
        stack_t_max[(k - 1) * RAYS + r] = stack_t_max[k * RAYS + r];
    }
    any_awake = any_awake || t_min[r] < t_max[r];
}

void pop() {
    node = stack_node[0];
    for (int k = 1; k < STACK_SIZE; ++k) {
        stack_node[k - 1] = stack_node[k];
    }
    --stacked;
    EACH(pop_ray)
}

// Pop entries until a ray of the packet is awake (t_min < t_max) in the popped node.
void pop_awake() {
    if (any_left && stacked > 0) {
        do {
            pop();
        } while (!any_awake && stacked > 0);
    }
}
