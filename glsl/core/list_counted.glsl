// The list of a leaf's references. `state.end` is the index after the last reference.
//
// Node i is the leaf. A method defines LIST_LENGTH(i), the number of the leaf's references.

void no_list(inout State state) {
    state.cursor = 0;
    state.end = 0;
}

void open_list(int i, int first, inout State state) {
    state.cursor = first;
    state.end = first + LIST_LENGTH(i);
}

bool is_empty(int first, State state) {
    return first == state.end;
}

// Advance to the next reference. Return whether the list has ended.
bool list_ends(inout State state) {
    ++state.cursor;
    return state.cursor == state.end;
}
