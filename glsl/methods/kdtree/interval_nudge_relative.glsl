// `interval=nudge-relative`, there to be measured: a ray continues a few ulp behind its leaf. A ray still
// hangs where the t of the plane is off by more.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

float resumed(float t) {
    return R(t + R(abs(t) * (4.0 * ARITHMETIC_UNIT)));
}
