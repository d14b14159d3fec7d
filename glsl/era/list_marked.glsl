// The list of a leaf's references in the era form with fp24. This file replaces core/list_counted.glsl. The
// last reference has a mark, so a ray's state needs no field for the end of the list. An empty leaf points
// to no reference. Node i is the leaf.

void no_list(inout State state) {
    state.cursor = FIRST;
}

void open_list(pointer i, pointer first, inout State state) {
    state.cursor = first;
}

bool is_empty(pointer first, State state) {
    return is_null(first);
}

// Advance to the next reference. Return whether the list has ended.
bool list_ends(inout State state) {
    pointer tested = state.cursor;
    state.cursor = moved(tested, 1);
    return reference_last(tested) != 0;
}
