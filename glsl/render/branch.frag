#version 330 core
// Write the rays that continue from hits (Whitted 1980): reflected rays, or refracted rays if REFRACTED is
// defined. Each ray gets a weight, the share of its light that reaches the pixel. If no ray continues, the
// fragment is discarded; a cleared texel holds an empty ray. An occlusion query around this pass shows
// whether any ray exists.

#include "core/fetch.glsl"
#include "core/precision.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"
#include "render/spawn.glsl"
#include "render/surface.glsl"
#ifdef DIELECTRICS
#include "render/fresnel.glsl"
#endif
#include "render/onward.glsl"

#ifdef REFRACTED
const bool REFRACTS = true;
#else
const bool REFRACTS = false;
#endif

uniform bool first_wave;    // whether the incoming rays are eye rays, of weight 1

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    Hit hit = hit_load(pixel);
    if (!hit_found(hit)) {
        discard;
    }
    Surface surface = surface_at(ray, hit);
    vec3 weight = first_wave ? vec3(1.0) : path_load(pixel).weight;
    Onward on = onward(surface, ray.direction, REFRACTS);
    weight *= on.share;
    if (!(max(max(weight.r, weight.g), weight.b) >= CUTOFF)) {
        discard;
    }
    Spawn spawn = spawn_setup(hit, on.side);
    Bounce bounce;
    bounce.direction = stored(normalize(on.direction));
    bounce.t_min = spawn_t_min();
    bounce.t_max = INFINITE;
    for (int tries = 0; tries < SPAWN_TRIES; ++tries) {
        bounce.origin = spawn_origin(spawn);
        Rays ray = Rays(bounce.origin, bounce.t_min, bounce.direction, bounce.t_max);
        if (!spawn_further(spawn, spawn_hits_itself(spawn, ray))) {
            break;
        }
    }
    bounce_store(bounce);
    next_path_store(Next_path(weight));
}
