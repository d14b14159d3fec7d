#version 330 core
// Copy the hits for all lights after the first, because tracing shadow rays overwrites the hits.

#include "core/precision.glsl"
#include <streams>

void main() {
    Hit hit = hit_load(ivec2(gl_FragCoord.xy));
    kept_store(Kept(hit.t, hit.u, hit.v, hit.triangle));
}
