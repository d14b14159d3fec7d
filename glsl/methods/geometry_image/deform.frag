#version 330 core
// Moves a geometry image: each texel from its position at rest (Carr et al. 2006 deform in a fragment
// program before the pyramids are made). Where two texels rest at one place they stay at one: what
// <deformation> defines sees nothing but the place.

#include "core/fetch.glsl"
#include "core/precision.glsl"
#include <tables>
#include <deformation>

uniform float time;

layout(location = 0) out vec4 moved;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec3 place = deform(rest_at((texel.y << TABLE_WIDTH_LOG2) + texel.x), time);
    moved = vec4(stored(place), 0.0);
}
