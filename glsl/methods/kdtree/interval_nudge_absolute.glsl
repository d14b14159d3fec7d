// `interval=nudge-absolute`, for measurements only: a ray continues 1e-6 behind the end of its leaf. So the
// ray skips leaves that it would cross in less than 1e-6.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

float resumed(float t) {
    return R(t + 1e-6);
}
