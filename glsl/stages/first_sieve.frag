#version 330 core
// Drops the triangles that no ray of the image can hit: they lie outside the image or between the centres
// of pixels.

#include "core/fetch.glsl"
#include "core/stream.glsl"
#include <tables>
#include "stages/cover.glsl"

out float kept;

void main() {
    int i = element();
    Cover cover = cover_of(triangle_v0(i), triangle_v1(i), triangle_v2(i));
    ivec4 pixels = covered_pixels(cover);
    bool between = pixels.z < pixels.x || pixels.w < pixels.y;
    kept = cover.outside || between ? 0.0 : 1.0;
}
