#version 330 core
// Eye rays through the pixel centres, row 0 at the top (Purcell et al. 2002, the first of their
// four kernels).

#include "common/precision.glsl"
#include <streams>

uniform vec3 eye;
uniform vec3 right;
uniform vec3 up;
uniform vec3 forward;
uniform vec2 size;

void main() {
    vec2 at = 2.0 * gl_FragCoord.xy / size - 1.0;
    vec3 direction = normalize(forward + at.x * right - at.y * up);
    rays_store(Rays(eye, 0.0, direction, uintBitsToFloat(0x7f800000u)));   // without end
}
