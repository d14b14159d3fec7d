// Where the rays of a sorted list stand in their texture: along a Morton curve through squares of
// BLOCK texels, so that neighbours in the list are neighbours in every direction.

const int BLOCK_LOG2 = 3;

int odd_bits(int v) {
    return (v & 1) | (v >> 1 & 2) | (v >> 2 & 4);
}

ivec2 sorted_pixel(int i, int blocks_a_row) {
    int block = i >> (2 * BLOCK_LOG2);
    return (ivec2(block % blocks_a_row, block / blocks_a_row) << BLOCK_LOG2)
         + ivec2(odd_bits(i), odd_bits(i >> 1));
}

int sorted_place(ivec2 pixel, int blocks_a_row) {
    ivec2 block = pixel >> BLOCK_LOG2;
    ivec2 v = pixel & ((1 << BLOCK_LOG2) - 1);
    v = (v & 1) | (v & 2) << 1 | (v & 4) << 2;
    return (block.x + block.y * blocks_a_row) << (2 * BLOCK_LOG2) | v.x | v.y << 1;
}
