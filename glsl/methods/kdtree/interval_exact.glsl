// `interval=exact`: a ray continues exactly at the end of its leaf. A plane at or before t_min sends the
// ray to the far child.
//
// The same expression always computes t_split. So when a ray continues at the end of a leaf, the t_split of
// the plane that ends the leaf equals t_min. The ray then always moves on, and no epsilon is needed.

bool takes_far_child(float t_split, float t_min) {
    return t_split <= t_min;
}

// The t at which a ray continues behind a leaf that ends at t.
float resumed(float t) {
    return t;
}
