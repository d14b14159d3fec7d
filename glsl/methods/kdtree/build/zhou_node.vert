#version 330 core
// Sends each node to its place in the finished tree. A small root (a small node whose parent is large) is
// in two lists. Only the pass over the list of small nodes (without LARGE) sends a small root.

#include <sources>
#include "core/fetch.glsl"
#include "algorithms/point.glsl"

flat out int source;

void main() {
    source = gl_VertexID;
    int slot = place_load(table_texel(source)).at;
#ifdef LARGE
    bool root = starts_load(table_texel(source + 1)).value.z
        > starts_load(table_texel(source)).value.z;
    slot = root ? -1 : slot;
#endif
    place_point(slot);
}
