// `interval=nudge-relative`, for measurements only: a ray continues a few ulp behind its leaf. If the t of
// the plane errs by more, the ray still never ends.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

float resumed(float t) {
    return R(t + R(abs(t) * (4.0 * ARITHMETIC_UNIT)));
}
