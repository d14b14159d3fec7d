// Keeps the ray's state in registers. Discards unfinished rays, so that an occlusion query counts finished
// rays.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
