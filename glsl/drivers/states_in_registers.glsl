// A single pass runs the whole traversal and stores no states. A ray whose traversal did not end, because of
// the limits on loop iterations or on steps, is discarded. An occlusion query then finds fewer fragments than
// rays, and passes that store states trace all rays anew.

void end_pass(State state) {
    if (state.phase != DONE) {
        discard;
    }
}
