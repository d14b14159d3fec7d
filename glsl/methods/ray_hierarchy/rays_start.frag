#version 330 core
// Writes the state of the rays before the first batch of triangles.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/phase.glsl"

void main() {
    Ray ray = ray_setup(rays_load(ivec2(gl_FragCoord.xy)));
    CLEAR_COUNTERS;
    state_store(state_stored(State(ray.t_min <= ray.t_max ? INTERSECT : DONE, 0)));
    hit_store(hit_stored(no_hit(ray.t_max)));
    STORE_COUNTERS;
}
