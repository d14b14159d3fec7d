// The state stays in registers. Unfinished rays are discarded. An occlusion query counts the finished rays.

void end_pass(State state) {
    if (state.phase != DONE) discard;
}
