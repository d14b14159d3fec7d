#version 330 core
// Writes a candidate, that is, a possible nearest hit of a ray. Blending combines the candidates of each
// ray (nearest.vert).

#include <records>
#include "core/fetch.glsl"

flat in int number;

void main() {
    Tested candidate = tested_load(table_texel(number));
#ifdef LOWEST
    lowest_store(Lowest(candidate.triangle));
#elif defined(HITS)
    Met met = met_load(table_texel(number));
    hit_store(Hit(candidate.t, met.u, met.v, candidate.triangle));
#else
    least_store(Least(candidate.t, vec2(0.0), 1));
#endif
}
