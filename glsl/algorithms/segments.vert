#version 330 core
// The scatter of stream reduction by blocks (Roger, Assarsson, Holzschuch, "Efficient Stream
// Reduction on the GPU", 2007; survey 3.6.2): what is kept of a block stands side by side, so a line
// as long as that takes it there, and only its ends have to be sent. Where it would cross the end of
// a row it is two lines.
//
// A line covers the texels whose diamond it leaves: from the middle of its first texel to the middle
// of the one behind its last. That one may lie behind the end of the row, where a line would be clipped
// to an end on a diamond's corner: so the viewport is twice as wide as the target.

#include <sources>
#include "core/fetch.glsl"

uniform int target_rows;

flat out int block;
flat out int block_start;
flat out int block_total;

void main() {
    block = gl_VertexID >> 2;
    block_start = int(starts_load(table_texel(block)).value.x);
    int end = int(starts_load(table_texel(block + 1)).value.x);
    block_total = end - block_start;
    int row = block_start >> TABLE_WIDTH_LOG2;
    int row_end = min(end, (row + 1) << TABLE_WIDTH_LOG2);
    bool second = (gl_VertexID & 2) != 0;
    int first = second ? row_end : block_start;
    int last = second ? end : row_end;
    row += int(second);
    int column = ((gl_VertexID & 1) == 0 ? first : last) - (row << TABLE_WIDTH_LOG2);
    vec2 clip = 2.0 * (vec2(column, row) + 0.5)
                / vec2(2 << TABLE_WIDTH_LOG2, target_rows) - 1.0;
    gl_Position = first >= last ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(clip, 0.0, 1.0);
}
