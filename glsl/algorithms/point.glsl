// Scatter by points: a fragment cannot choose where it writes, but a vertex can place a point anywhere.

uniform int target_rows;

// Draw a point at texel `slot`; -1 draws nothing.
void place_point(int slot) {
    vec2 texel = vec2(table_texel(slot)) + 0.5;
    vec2 clip = 2.0 * texel / vec2(1 << TABLE_WIDTH_LOG2, target_rows) - 1.0;
    gl_Position = slot < 0 ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(clip, 0.0, 1.0);
}
