#version 330 core
// Copies entry lists from several render targets (four entries each) into one texture, because a fragment
// can choose among texels, but not among samplers.

#include <streams>

uniform int entry_tiles_across;

#define READ(k) list = part == k ? entries.list_##k : list

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int part = pixel.x / entry_tiles_across;
    Entries entries = entries_load(ivec2(pixel.x - part * entry_tiles_across, pixel.y));
    ivec4 list = ivec4(0);
    EACH_LIST(READ);
    entry_list_store(Entry_list(list));
}
