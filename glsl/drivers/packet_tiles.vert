#version 330 core
// Points that cover side x side packets each. A tile without a live ray, or a tile whose beam meets
// nothing, gets no point, so its packets are not drawn at all. Tile culling thus rejects packets before any
// fragment is created. A mask by depth (Purcell et al. 2002) tests every fragment.

in ivec2 square;          // number of the square, across and down
uniform ivec2 squares;    // number of squares, across and down
uniform int side;

void main() {
    gl_PointSize = float(side);
    gl_Position = vec4((vec2(square) + 0.5) * 2.0 / vec2(squares) - 1.0, 0.0, 1.0);
}
