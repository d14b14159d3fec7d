// Maps places in the sorted list of rays to texels, and back. The rays follow a Morton curve through each
// square of 2^SQUARE_LOG2 x 2^SQUARE_LOG2 texels, so neighbours in the list are close in x and y.

const int SQUARE_LOG2 = 3;   // the same size as SQUARE in gpgpu_rt/rays/order.py

int odd_bits(int v) {
    return (v & 1) | (v >> 1 & 2) | (v >> 2 & 4);
}

ivec2 sorted_pixel(int i, int squares_a_row) {
    int square = i >> (2 * SQUARE_LOG2);
    return (ivec2(square % squares_a_row, square / squares_a_row) << SQUARE_LOG2)
         + ivec2(odd_bits(i), odd_bits(i >> 1));
}

int sorted_place(ivec2 pixel, int squares_a_row) {
    ivec2 square = pixel >> SQUARE_LOG2;
    ivec2 v = pixel & ((1 << SQUARE_LOG2) - 1);
    v = (v & 1) | (v & 2) << 1 | (v & 4) << 2;
    return (square.x + square.y * squares_a_row) << (2 * SQUARE_LOG2) | v.x | v.y << 1;
}
