// `interval=strict`, there to be measured: a plane at t_min sends the ray to the near child. A ray that
// leaves a leaf then reaches the same leaf again, for ever.

bool takes_far_child(float t_split, float t_min) {
    return t_split < t_min;
}

float resumed(float t) {
    return t;
}
