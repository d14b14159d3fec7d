#version 330 core
// Stream reduction: element i of the target gets the index of the i-th kept element (Horn 2005; survey,
// section 3.6).

#include <records>
#include "core/stream.glsl"
#include "algorithms/search.glsl"

uniform int elements;   // number of elements before the reduction

void main() {
    source_store(Source(find_flagged(element(), 0, elements)));
}
