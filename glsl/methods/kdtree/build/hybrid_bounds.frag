#version 330 core
// Computes the bounds of a large node's pieces: the union of its chunks' bounds (zhou_chunks.frag).

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

void main() {
    int i = element();
    int first = int(starts_load(table_texel(i)).value.w);
    int end = int(starts_load(table_texel(i + 1)).value.w);
    Box box = Box(vec3(INFINITY), vec3(-INFINITY));
    for (int c = first; c < end; ++c) {
        Chunk chunk = chunk_load(table_texel(c));
        box.lo = min(box.lo, chunk.lo);
        box.hi = max(box.hi, chunk.hi);
    }
    box_store(box);
}
