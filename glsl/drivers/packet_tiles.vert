#version 330 core
// Draws a point over a tile of `side` x `side` packets. A tile gets no point if it has no live
// ray or if its beam (stages/packet_entries.frag) meets nothing. The tile's packets then have no fragments.
// A mask by depth (Purcell et al. 2002) would need a depth test for every fragment.

in ivec2 square;          // column and row of the tile
uniform ivec2 squares;    // number of tiles, across and down
uniform int side;

void main() {
    gl_PointSize = float(side);
    gl_Position = vec4((vec2(square) + 0.5) * 2.0 / vec2(squares) - 1.0, 0.0, 1.0);
}
