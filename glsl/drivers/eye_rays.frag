#version 330 core
// Eye rays through the pixel centres (Purcell et al. 2002, the first of their four kernels), or all as
// far beside them, as pictures are shifted to be added up (Haeberli and Akeley, "The Accumulation
// Buffer", SIGGRAPH 1990).

#include "core/precision.glsl"
#include <streams>
#include "drivers/eye.glsl"

uniform vec2 corner;    // of what is drawn, in the picture
uniform vec2 aside;     // of the centres, pixels

void main() {
    rays_store(eye_ray((gl_FragCoord.xy + corner) + aside));
}
