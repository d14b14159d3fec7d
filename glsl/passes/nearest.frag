#version 330 core
// What a candidate brings to its ray.

#include <records>
#include "common/fetch.glsl"

flat in int number;

void main() {
    Tested candidate = tested_load(table_texel(number));
#ifdef LOWEST
    lowest_store(Lowest(candidate.triangle));
#else
    least_store(Least(candidate.t, vec2(0.0), 1));
#endif
}
