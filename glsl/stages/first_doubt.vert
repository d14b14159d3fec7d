#version 330 core
// Draws a rectangle over the pixels whose eye rays may hit a triangle, within one part of the image.

#include <constants>
#include "core/fetch.glsl"
#include <tables>
#include "stages/cover.glsl"

in ivec3 part;             // row of the triangle, and the part's first pixel

uniform int part_side;

flat out int rival;

void main() {
    rival = part.x;
    int corner = gl_VertexID % 6;
    ivec4 pixels = covered_pixels(cover_of(triangle_v0(rival), triangle_v1(rival),
                                           triangle_v2(rival)));
    pixels = ivec4(max(pixels.xy, part.yz), min(pixels.zw, part.yz + part_side - 1));
    vec2 place = vec2(corner == 1 || corner >= 4 ? pixels.z + 1 : pixels.x,
                      corner == 2 || corner == 3 || corner == 5 ? pixels.w + 1 : pixels.y);
    gl_Position = vec4(2.0 * place / size - 1.0, 0.0, 1.0);
}
