// Where texel i of a table lies: tables are 2^TABLE_WIDTH_LOG2 texels wide, so that no division
// by a reciprocal can land in the wrong row.

ivec2 table_texel(int i) {
    return ivec2(i & ((1 << TABLE_WIDTH_LOG2) - 1), i >> TABLE_WIDTH_LOG2);
}
