// Where texel i of a table lies: tables are 2^TABLE_WIDTH_LOG2 texels wide, so that no division
// by a reciprocal can land in the wrong row.

ivec2 table_texel(int i) {
    return ivec2(i & ((1 << TABLE_WIDTH_LOG2) - 1), i >> TABLE_WIDTH_LOG2);
}

// TABLE_FETCH(name, i) is texel i of a table, `row` the distance of its rows. It samples: tables have one
// level and no filter, and a texel's middle, rounded, lies within it, so that this is the same texel in
// any control flow. llvmpipe asks texelFetch for each lane's level and its size, at twice the
// instructions. With TEXEL_FETCH (period hardware's cost model) the fetch is what it says.

#ifdef TEXEL_FETCH
#define TABLE_FETCH(name, i) texelFetch(name##_table, table_texel(i), 0)
#else

vec2 table_place(int i, float row) {
    return (vec2(table_texel(i)) + 0.5) * vec2(1.0 / float(1 << TABLE_WIDTH_LOG2), row);
}

#define TABLE_FETCH(name, i) texture(name##_table, table_place(i, name##_table_row))
#endif
