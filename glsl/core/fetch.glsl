// Where texel i of a table lies: tables are 2^TABLE_WIDTH_LOG2 texels wide, so that no division
// by a reciprocal can land in the wrong row.

#include "core/texel.glsl"

ivec2 table_texel(int i) {
    return ivec2(i & ((1 << TABLE_WIDTH_LOG2) - 1), i >> TABLE_WIDTH_LOG2);
}

const float TABLE_COLUMN = 1.0 / float(1 << TABLE_WIDTH_LOG2);

// Texel i of a table; `name_table_row` is the distance of its rows.
#define TABLE_FETCH(name, i) TEXEL(name##_table, vec2(TABLE_COLUMN, name##_table_row), table_texel(i))
