#version 330 core
// Draws a point over each chosen tile of `side` x `side` packets. A tile without a live ray, or whose beam
// meets nothing, gets no point, so no fragment of its packets is created. A mask by depth (Purcell et al.
// 2002) would test every fragment.

in ivec2 square;          // column and row of the tile
uniform ivec2 squares;    // number of tiles, across and down
uniform int side;

void main() {
    gl_PointSize = float(side);
    gl_Position = vec4((vec2(square) + 0.5) * 2.0 / vec2(squares) - 1.0, 0.0, 1.0);
}
