#version 330 core
// A copy of hits, for lights after the first: shadow rays are traced where hits were.

#include "core/precision.glsl"
#include <streams>

void main() {
    Hit hit = hit_load(ivec2(gl_FragCoord.xy));
    kept_store(Kept(hit.t, hit.u, hit.v, hit.triangle));
}
