// The state stays in registers. A ray that does not end is discarded; an occlusion query counts the others.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
