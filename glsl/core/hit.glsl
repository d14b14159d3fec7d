// The nearest hit so far. Before the first hit, `triangle` is NO_TRIANGLE and `t` is the ray's t_max.

Hit no_hit(float t_max) {
    return Hit(t_max, 0.0, 0.0, NO_TRIANGLE);
}

bool hit_found(Hit hit) {
    return hit.triangle != NO_TRIANGLE;
}

// Whether a ray's search is over: only a shadow ray stops at its first hit.
bool search_over(Hit hit) {
#ifdef ANY_HIT
    return hit_found(hit);
#else
    return false;
#endif
}
