#version 330 core
// One level of a reduction. A fragment joins FAN neighbouring values with the macro COMBINE. If COMBINE is
// a sum, the levels are the upward half of Blelloch's scan ("Prefix Sums and Their Applications", 1990).

#include <records>
#include "core/stream.glsl"

uniform int elements;   // number of elements in the level below

#define SUM(a, b) ((a) + (b))

void main() {
    int first = FAN * element();
    vec4 value = values_load(table_texel(first)).value;
    for (int i = first + 1; i < min(first + FAN, elements); ++i) {
        vec4 other = values_load(table_texel(i)).value;
        value = COMBINE(value, other);
    }
    reduced_store(Reduced(value));
}
