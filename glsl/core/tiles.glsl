// An atlas of tiles side by side, each as large as the state textures. Tiles replace the layers of a
// layered texture, which this platform does not offer.

uniform ivec2 tile_size;
uniform int tiles_a_row;

// Divide integers in float32, as period hardware did; software renderers are faster that way too. The
// added half keeps quotients below 2^22 farther from whole numbers than their rounding error.
ivec2 tile_of(ivec2 texel) {
    return ivec2((vec2(texel) + 0.5) / vec2(tile_size));
}

int tile_number(ivec2 tile) {
    return tile.x + tiles_a_row * tile.y;
}

ivec2 tile_corner(int number) {
    int row = int((float(number) + 0.5) / float(tiles_a_row));
    return tile_size * ivec2(number - row * tiles_a_row, row);
}
