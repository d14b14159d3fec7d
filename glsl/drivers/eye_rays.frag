#version 330 core
// Eye rays through the pixel centres (Purcell et al. 2002, the first of their four kernels). The
// accumulation buffer adds up pictures with different values of `aside` (Haeberli and Akeley, "The
// Accumulation Buffer", SIGGRAPH 1990).

#include "core/precision.glsl"
#include <streams>
#include "drivers/eye.glsl"

uniform vec2 corner;    // first pixel of the drawn part, in the picture
uniform vec2 aside;     // shift of all rays from the pixel centres, pixels

void main() {
    rays_store(eye_ray((gl_FragCoord.xy + corner) + aside));
}
