#version 330 core
// A corner of what a caustic may fall on, as the light sees it.

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
