// `interval=nudge-absolute`, for measurements only: a ray continues behind the end of its leaf, at t +
// 1e-6, and skips leaves thinner than that.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

float resumed(float t) {
    return R(t + 1e-6);
}
