#version 330 core
// Distributes the hits of packets of 2x2 rays to the rays. A texel of the packets' textures holds one
// number for each of the four rays. The papers have no such pass.

#include <streams>
#include "core/phase.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Packet found = packet_load(pixel / 2);
    int ray = pixel.x % 2 + 2 * (pixel.y % 2);
    State state;
    state.phase = DONE;
    state_store(state);
    hit_store(Hit(found.t[ray], found.u[ray], found.v[ray], found.triangle[ray]));
}
