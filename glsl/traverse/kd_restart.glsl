// kd-restart: Foley and Sugerman 2005, section 4 (survey, section 3.4, Figure 11 left). A ray that
// leaves a leaf without a hit takes the rest of its interval and starts over at the root.

#include "traverse/kd_common.glsl"

void continue_search(inout State state) {
    state.node = 0;
    state.phase = DOWN;
}
