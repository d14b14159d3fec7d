#version 330 core
// What a candidate brings to its ray.

#include <records>
#include "common/fetch.glsl"

flat in int number;

void main() {
    Candidate candidate = candidate_load(table_texel(number));
#ifdef LOWEST
    lowest_store(Lowest(candidate.triangle));
#else
    nearest_store(Nearest(candidate.t, vec2(0.0), 1));
#endif
}
