// `interval=exact`: a ray continues exactly at the end of its leaf. A plane at or before t_min sends the
// ray to the far child. The same expression always computes t_split. So the t_split of the plane that ended
// the previous leaf equals t_min, and the ray moves on without an epsilon.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

// The t at which a ray continues behind a leaf that ends at t.
float resumed(float t) {
    return t;
}
