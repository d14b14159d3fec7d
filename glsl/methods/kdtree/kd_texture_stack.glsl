// kd-texture-stack: Ernst, Vogelgsang, Greiner, "Stack Implementation on Programmable Graphics Hardware",
// VMV 2004 (survey, section 3.4). Each ray has a texel in every tile of an atlas, one tile for each stack
// level. A fragment cannot choose where it writes. A push therefore draws all tiles and keeps the tile that
// the ray's stack pointer names (drivers/push.frag). A pop is a dependent read.
//
// A ray that pushes a far child waits in phase PUSH until the atlas has been drawn. A ray whose stack is
// full stops and is flagged.

#include "core/tiles.glsl"
#include "methods/kdtree/kd_common.glsl"

void start_search(inout State state) {
    state.stacked = 0;
    state.far = FIRST;
    state.far_t_max = 0.0;
}

void take_only_child(inout State state) {
}

void pass_far_child(pointer far, float t_max, inout State state) {
    state.far = far;
    state.far_t_max = t_max;
    state.phase = PUSH;
}

void leave_leaf(inout State state, Hit hit) {
    state.phase = is_settled(state, hit) ? DONE : POP;
}

// Finish a push: the atlas has been drawn and holds the entry, so count the entry.
void push(Ray ray, inout State state, inout Hit hit) {
    ++state.stacked;
    state.phase = state.stacked > STACK_SIZE ? OVERFLOWN : DOWN;
}

void pop(Ray ray, inout State state, inout Hit hit) {
    --state.stacked;
    Stack_entry entry = stack_entry_load(tile_corner(state.stacked) + ivec2(gl_FragCoord.xy));
    state.t_min = resumed(state.t_max);
    state.t_max = entry.t_max;
    state.node = entry.node;
    state.phase = DOWN;
}
