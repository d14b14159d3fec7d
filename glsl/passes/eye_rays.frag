#version 330 core
// Eye rays through the pixel centres, row 0 at the top (Purcell et al. 2002, the first of their
// four kernels). From an eye far outside the scene's sphere rays start nearer, as in approach.py; the
// picture needs no t, and a start that is off by its rounding is off by less than the direction is.

#include "common/precision.glsl"
#include <streams>

uniform vec3 eye;
uniform vec3 right;
uniform vec3 up;
uniform vec3 forward;
uniform vec2 size;
uniform vec3 centre;    // of the scene's sphere
uniform float beyond;   // rays start this far before the centre; 0 where the eye is near

void main() {
    vec2 at = 2.0 * gl_FragCoord.xy / size - 1.0;
    vec3 direction = normalize(forward + at.x * right - at.y * up);
    float ahead = beyond > 0.0 ? max(dot(centre - eye, direction) - beyond, 0.0) : 0.0;
    rays_store(Rays(eye + ahead * direction, 0.0, direction, uintBitsToFloat(0x7f800000u)));   // without end
}
