// The state stays in registers. Fragments of unfinished rays are discarded; a query counts the other rays.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
