#version 330 core
// Sends each candidate for a ray's nearest hit to the texel of the ray. In the first pass, blending keeps
// the least t and counts the candidates. With LOWEST, only the candidates with the least t are sent, and
// blending keeps the lowest index of their triangles. With HITS, only the candidate with this t and index
// is sent. A depth test cannot replace the blending: 24 bits do not distinguish nearly equal t.

#include <sources>
#include "core/fetch.glsl"

uniform ivec2 size;   // size of the rays' texture

flat out int number;

void main() {
    number = gl_VertexID;
    Tested candidate = tested_load(table_texel(number));
    ivec2 pixel = ivec2(candidate.x, candidate.y);
    bool drawn = true;
#ifdef LOWEST
    drawn = candidate.triangle >= 0 && candidate.t == least_load(pixel).t;
#endif
#ifdef HITS
    drawn = candidate.triangle >= 0 && candidate.t == least_load(pixel).t
            && candidate.triangle == lowest_load(pixel).triangle;
#endif
    vec2 clip = 2.0 * (vec2(pixel) + 0.5) / vec2(size) - 1.0;
    gl_Position = drawn ? vec4(clip, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
