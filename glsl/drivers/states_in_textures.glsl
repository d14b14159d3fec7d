// Each pass stores the states of its rays. The next pass continues from them.

void end_pass(State state) {
    state_store(state);
}
