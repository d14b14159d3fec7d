#version 330 core
// The box around a triangle's cover that is parallel to its longest side, or the whole image where
// nothing is known of it; as near as it can be hit. Conservative rasterisation (Hasselgren,
// Akenine-Moeller, Ohlsson, GPU Gems 2, 2005) moves the edges instead, which takes a bound for acute
// corners; a box needs none.

#include <constants>
#include "common/fetch.glsl"
#include <tables>
#include "common/cover.glsl"

in int row;

flat out int rival;

void main() {
    rival = row;
    int corner = gl_VertexID % 6;
    vec2 place = vec2(corner == 1 || corner >= 4 ? 1.0 : 0.0, corner == 2 || corner == 3 || corner == 5 ? 1.0 : 0.0);
    Cover cover = cover_of(triangle_v0(row), triangle_v1(row), triangle_v2(row));
    if (cover.unbounded) {
        gl_Position = vec4(2.0 * place - 1.0, -1.0, 1.0);
        return;
    }
    vec2 ab = cover.b - cover.a;
    vec2 bc = cover.c - cover.b;
    vec2 ca = cover.a - cover.c;
    vec2 along = length_squared(ab) >= length_squared(bc) ? ab : bc;
    along = length_squared(along) >= length_squared(ca) ? along : ca;
    along = length_squared(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
    mat2 turned = mat2(along, vec2(-along.y, along.x));
    vec2 b = ab * turned;     // from a, in the box's axes
    vec2 c = -ca * turned;
    vec2 lo = min(min(b, c), 0.0) - cover.margin;
    vec2 hi = max(max(b, c), 0.0) + cover.margin;
    vec2 pixels = cover.a + turned * mix(lo, hi, place);
    float depth = clamp(cover.depth / farthest - PROPER, 0.0, 1.0);
    gl_Position = vec4(2.0 * pixels / size - 1.0, 2.0 * depth - 1.0, 1.0);
}
