#version 330 core
// Points that cover packets, side x side of them each, where there is something to trace: of tiles in
// which no ray is live, or whose beam meets nothing, there is no point, and packets are not drawn at all.
// So does tile culling reject before any fragment is made, where a mask by depth (Purcell et al. 2002)
// has each fragment looked at.

in ivec2 square;          // across and down
uniform ivec2 squares;    // how many
uniform int side;

void main() {
    gl_PointSize = float(side);
    gl_Position = vec4((vec2(square) + 0.5) * 2.0 / vec2(squares) - 1.0, 0.0, 1.0);
}
