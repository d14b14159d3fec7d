// The state stays in registers. The fragment of a ray whose search has not finished is discarded; an
// occlusion query counts the finished rays.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
