// Keeps the ray's state in registers. Discards unfinished rays: an occlusion query counts the others.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
