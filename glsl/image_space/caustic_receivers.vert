#version 330 core
// Project a corner of a receiving triangle into the light's image.

#include <constants>
#include "core/fetch.glsl"
#include <tables>
#include "stages/cover.glsl"

out vec3 place;

void main() {
    int row = gl_VertexID / 3;
    int corner = gl_VertexID % 3;
    place = corner == 0 ? triangle_v0(row) : corner == 1 ? triangle_v1(row) : triangle_v2(row);
    gl_Position = clip_place(place);
}
