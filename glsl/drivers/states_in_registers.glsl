// Keeps the state in registers. Discards unfinished rays: an occlusion query counts the finished rays.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
