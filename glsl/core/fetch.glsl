// `table_texel` finds the position of texel i. It shifts, because a division could round to a wrong row.
//
// TABLE_INTEGER converts a number of a table to int. With SMALL_INTEGERS no integer in the tables exceeds
// 2^22, and adding 1.5 * 2^23 moves the integer to the lowest bits of the sum. int(x) is slower, because
// llvmpipe of Mesa 25 converts lane by lane.

#include "core/texel.glsl"

ivec2 table_texel(int i) {
    return ivec2(i & ((1 << TABLE_WIDTH_LOG2) - 1), i >> TABLE_WIDTH_LOG2);
}

const float TABLE_COLUMN = 1.0 / float(1 << TABLE_WIDTH_LOG2);

// Read texel i of a table. `name_table_row` is the distance between two rows in texture coordinates.
#define TABLE_FETCH(name, i) TEXEL(name##_table, vec2(TABLE_COLUMN, name##_table_row), table_texel(i))

#ifdef SMALL_INTEGERS
#define TABLE_INTEGER(x) (floatBitsToInt((x) + 12582912.0) - 0x4B400000)
#else
#define TABLE_INTEGER(x) int(x)
#endif
