// The nearest hit so far. Until there is one, hit.t holds the end of the ray: t is always how far
// it still pays to search. Of triangles at exactly the same t the lowest index wins.

Hit no_hit(float t_max) {
    return Hit(t_max, 0.0, 0.0, NO_TRIANGLE);
}

bool hit_found(Hit hit) {
    return hit.triangle != NO_TRIANGLE;
}

// Any hit will do for a shadow ray: a kernel that asks this ends as soon as it is true.
bool search_over(Hit hit) {
#ifdef ANY_HIT
    return hit_found(hit);
#else
    return false;
#endif
}
