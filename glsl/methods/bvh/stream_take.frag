#version 330 core
// Compacts a filtered stream: keeps the elements whose flag FLAG (search.glsl) is set, in their order.

#include <records>
#include "core/stream.glsl"
#include "algorithms/search.glsl"

uniform int base;        // the first element that is drawn
uniform int elements;    // number of elements before the compaction

void main() {
    Visited from = visited_load(table_texel(find_flagged(element() - base, 0, elements)));
#ifdef FAR
    queued_store(Queued(from.far, from.x, from.y, from.far_t));
#else
    queued_store(Queued(from.near, from.x, from.y, from.near_t));
#endif
}
