// `interval=exact`: a ray continues exactly at the end of its leaf. One expression computes every t_split.
// So in fp32, the plane that ended the last leaf has t_split = t_min and sends the ray to its far child.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

// The t at which a ray continues behind a leaf that ends at t.
float resumed(float t) {
    return t;
}
