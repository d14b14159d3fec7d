// `interval=strict`, for measurements only: a ray that meets a split plane at t_min enters the near
// child. A ray that leaves a leaf reaches the same leaf again and never ends.

bool takes_far_child(float t_split, float t_min) {
    return t_split < t_min;
}

float resumed(float t) {
    return t;
}
