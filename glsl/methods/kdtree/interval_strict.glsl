// `interval=strict`, for measurements only: a ray that meets a split plane at t_min enters the near child.
// After a leaf, t_min lies on the leaf's last plane. A restart or climb leads to this leaf again, forever.

bool takes_far_child(float t_split, float t_min) {
    return t_split < t_min;
}

float resumed(float t) {
    return t;
}
