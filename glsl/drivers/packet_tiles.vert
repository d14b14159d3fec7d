#version 330 core
// Draws a point over each chosen tile of `side` x `side` packets. When packets are traced, a tile without a
// live ray, or a tile whose beam meets nothing, gets no point, so its packets are not traced at all. This
// culling rejects packets before any fragment is created, whereas a mask by depth (Purcell et al. 2002)
// tests every fragment.

in ivec2 square;          // column and row of the tile
uniform ivec2 squares;    // number of tiles, across and down
uniform int side;

void main() {
    gl_PointSize = float(side);
    gl_Position = vec4((vec2(square) + 0.5) * 2.0 / vec2(squares) - 1.0, 0.0, 1.0);
}
