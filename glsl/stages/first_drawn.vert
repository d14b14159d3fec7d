#version 330 core
// Projects a triangle's corner into the image, to find candidates for the first hits of eye rays (survey,
// section 5).

#include <constants>
#include "core/fetch.glsl"
#include <tables>
#include "stages/cover.glsl"

in int row;

flat out float drawn;

void main() {
    int corner = gl_VertexID % 3;
    drawn = float(row);
    gl_Position = clip_place(corner == 0 ? triangle_v0(row)
                             : corner == 1 ? triangle_v1(row) : triangle_v2(row));
}
