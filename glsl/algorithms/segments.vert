#version 330 core
// Scatter of stream reduction by blocks (Roger, Assarsson, Holzschuch, "Efficient Stream Reduction on the
// GPU", 2007; survey, section 3.6). The kept elements of a block are adjacent in the target, so a line
// covers them, and only the line's two ends are sent as vertices. A line that would cross the end of a row
// is split in two.
//
// OpenGL draws a line's texel if the line leaves the diamond around the texel's centre. Each line therefore
// runs from the centre of its first texel to the centre of the texel after its last. This end may lie
// beyond the row. A viewport as wide as the target would clip such a line at the edge of its last texel,
// where the line has not left the diamond. So the viewport is twice as wide as the target.

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
