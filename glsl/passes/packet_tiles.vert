#version 330 core
// Points that cover packets, SQUARE x SQUARE of them each, in tiles of rays with something to trace: one
// in whose tiles no ray is live, or no beam meets anything, is put outside, and its packets are not drawn
// at all. So does tile culling reject before any fragment is made, where a mask by depth (Purcell et al.
// 2002) has each fragment looked at.

#include <tiles>

uniform ivec2 squares;    // across and down
uniform bool with_something;   // which tiles are drawn

void main() {
    ivec2 square = ivec2(gl_VertexID % squares.x, gl_VertexID / squares.x);
    gl_PointSize = float(SQUARE);
    gl_Position = vec4((vec2(square) + 0.5) * 2.0 / vec2(squares) - 1.0, 0.0, 1.0);
    ivec2 first = square * SQUARE * PACKET_SIZE / SIDE;
    bool some = false;
    for (int y = 0; y < max(SQUARE * PACKET_SIZE.y / SIDE, 1); ++y) {
        for (int x = 0; x < max(SQUARE * PACKET_SIZE.x / SIDE, 1); ++x) {
            some = some || has_something(first + ivec2(x, y));
        }
    }
    if (some != with_something) {
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    }
}
