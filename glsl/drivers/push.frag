#version 330 core
// Pushes stack entries, for kd-texture-stack, and for packets with a stack under the schedule `step`. For
// packets, the word "ray" below means "packet". Each tile of the atlas holds one stack level of all rays.
// The pass draws every tile, so each live ray has a fragment in every tile. For a ray in phase PUSH one of
// these fragments writes the entry: the fragment in the tile whose number is the height of the ray's stack.

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
