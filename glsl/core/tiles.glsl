// An atlas holds tiles side by side, each as large as the state textures. An atlas replaces a layered
// texture, because a fragment program cannot choose the layer that it writes.

uniform ivec2 tile_size;
uniform int tiles_a_row;

// Divide integers as float32 numbers, as the cards of 2002-2006 did; this is also faster on software
// renderers. The added 0.5 keeps the quotient away from whole numbers, so that rounding never changes its
// whole part. This is certain for dividends below 2^22.
ivec2 tile_of(ivec2 texel) {
    return ivec2((vec2(texel) + 0.5) / vec2(tile_size));
}

int tile_number(ivec2 tile) {
    return tile.x + tiles_a_row * tile.y;
}

ivec2 tile_corner(int number) {
    int row = int(floor((float(number) + 0.5) / float(tiles_a_row)));
    return tile_size * ivec2(number - row * tiles_a_row, row);
}
