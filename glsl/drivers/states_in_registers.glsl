// The state stays in registers. Fragments of unfinished rays are discarded. An occlusion query counts the
// finished rays.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
