// The state stays in registers. Discards unfinished rays, so that an occlusion query counts the finished
// rays.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
