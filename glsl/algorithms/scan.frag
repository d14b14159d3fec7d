#version 330 core
// One level of the downward half of a scan. Each element gets the sum of all elements before it. The level
// above has computed the sum of all earlier blocks of FAN elements. This level adds the earlier elements of
// the same block. In the survey (section 3.6), stream reduction begins with a scan (D. Horn, "Stream
// Reduction Operations for GPGPU Applications", GPU Gems 2, 2005).
//
// Departure: Horn runs log2 n passes over all n elements, and each pass doubles the distance between the
// two elements that it adds. Here, as in Blelloch's tree, the work is proportional to n. With FAN above 2,
// fewer levels suffice.

#include <records>
#include "core/stream.glsl"

uniform int elements;   // number of elements in this level; the sums have one more element, the total

void main() {
    int i = element();
    int block = i / FAN;
#ifdef CARRY
    vec4 sum = carry_load(table_texel(block)).value;
#else
    vec4 sum = vec4(0.0);
#endif
    for (int k = FAN * block; k < min(i, elements); ++k) {
        sum += values_load(table_texel(k)).value;
    }
    sums_store(Sums(sum));
}
