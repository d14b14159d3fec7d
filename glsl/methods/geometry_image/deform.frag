#version 330 core
// Deforms a geometry image: computes each texel from its rest position (Carr et al. 2006 deform the image
// in a fragment program before the pyramids are built). The function `deform` in <deformation> depends only
// on position and time, so texels with equal rest positions stay equal.

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
