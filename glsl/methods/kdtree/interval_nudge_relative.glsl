// `interval=nudge-relative`, for measurements only: a ray continues a few ulp behind the end of its leaf.
// If textures store t with fewer bits than arithmetic has, a ray may enter the same leaf again, forever.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

float resumed(float t) {
    return R(t + R(abs(t) * (4.0 * ARITHMETIC_UNIT)));
}
