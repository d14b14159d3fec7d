// A ray begins its walk along escape indices at the root.

#define LEAVE DONE

void begin(Ray ray, inout State state) {
    state.node = root_for(ray);
    state.phase = node_count != FIRST ? TRAVERSE : DONE;
}

bool subtree_ends(State state) {
    return is_null(state.node);
}
