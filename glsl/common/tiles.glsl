// An atlas of tiles side by side, each as large as the state textures: the layers of a layered
// texture, which this platform does not offer.

uniform ivec2 tile_size;
uniform int tiles_a_row;

ivec2 tile_corner(int tile) {
    return tile_size * ivec2(tile % tiles_a_row, tile / tiles_a_row);
}

int tile_at(ivec2 texel) {
    ivec2 tile = texel / tile_size;
    return tile.x + tiles_a_row * tile.y;
}
