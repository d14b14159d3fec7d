// The position of texel i of a table. Tables are 2^TABLE_WIDTH_LOG2 texels wide, so that a shift gives the
// row. A division that multiplies by a reciprocal could round to the wrong row.

#include "core/texel.glsl"

ivec2 table_texel(int i) {
    return ivec2(i & ((1 << TABLE_WIDTH_LOG2) - 1), i >> TABLE_WIDTH_LOG2);
}

const float TABLE_COLUMN = 1.0 / float(1 << TABLE_WIDTH_LOG2);

// Read texel i of a table. `name_table_row` is the distance between two rows in texture coordinates.
#define TABLE_FETCH(name, i) TEXEL(name##_table, vec2(TABLE_COLUMN, name##_table_row), table_texel(i))
