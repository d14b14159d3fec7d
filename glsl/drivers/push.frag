#version 330 core
// Pushes stack entries for the rays of kd-texture-stack. Under the schedule `step`, it does the same for
// packets with a stack; "ray" below then means "packet". Each tile of the atlas holds one stack level of
// all rays, so a ray has a fragment in every tile. A fragment writes the entry if its ray is in phase PUSH
// and its tile's number is the height of the ray's stack.

#include "core/precision.glsl"
#include "core/tiles.glsl"
#include <streams>

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    ivec2 tile = tile_of(texel);
    State state = state_load(texel - tile_size * tile);
    if (state.phase != PUSH || state.stacked != tile_number(tile)) {
        discard;
    }
    stack_entry_store(Stack_entry(state.far_t_max, state.far));
}
