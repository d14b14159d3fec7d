#version 330 core
// The push of kd-texture-stack. The pass draws every tile of the atlas where rays live. A fragment survives
// in the tile that the stack pointer of its ray names.

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
