#version 330 core
// The rays that go on from hits (Whitted 1980): reflected, or with REFRACTED refracted, each with the
// share of its light that reaches the pixel. A fragment without one is left as it was cleared, an
// empty ray, so that an occlusion query around this pass tells whether there are any.

#include "common/fetch.glsl"
#include "common/precision.glsl"
#include <streams>
#include <tables>
#include "common/stats.glsl"
#include "common/slack.glsl"
#include "common/ray.glsl"
#include "common/hit.glsl"
#include "common/triangle.glsl"
#include "common/spawn.glsl"
#include "common/surface.glsl"
#ifdef DIELECTRICS
#include "common/fresnel.glsl"
#endif

uniform bool first_wave;    // whose rays come from the eye, with all their weight

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    Hit hit = hit_load(pixel);
    if (!hit_found(hit)) {
        discard;
    }
    Surface surface = surface_at(ray, hit);
    vec3 weight = first_wave ? vec3(1.0) : path_load(pixel).weight;
    vec3 share = vec3(0.0);
    vec3 direction = reflect(ray.direction, surface.normal);
    vec3 side = surface.flat_normal;
#ifdef MIRRORS
    share = mirror_share(surface.material);
#endif
#ifdef DIELECTRICS
    float ior = dielectric_ior(surface.material);
    if (ior > 0.0) {
        ior = surface.outside ? ior : 1.0 / ior;
        float cosine = min(-dot(ray.direction, surface.normal), 1.0);
        share = vec3(fresnel(cosine, ior));
#ifdef REFRACTED
        share = 1.0 - share;
        direction = refracted(ray.direction, surface.normal, cosine, ior);
        side = -side;
    } else {
        share = vec3(0.0);
#endif
    }
#endif
    // A normal that was blended may send a ray through the triangle: the flat one does not.
    if (dot(direction, side) <= 0.0) {
        direction = reflect(direction, side);
    }
    weight *= share;
    if (!(max(max(weight.r, weight.g), weight.b) >= CUTOFF)) {
        discard;
    }
    Spawn spawn = spawn_setup(hit, side);
    Bounce bounce;
    bounce.direction = stored(normalize(direction));
    bounce.t_min = spawn_t_min();
    bounce.t_max = INFINITE;
    for (int tries = 0; tries < SPAWN_TRIES; ++tries) {
        bounce.origin = spawn_origin(spawn);
        if (!spawn_hits_itself(spawn, Rays(bounce.origin, bounce.t_min, bounce.direction,
                                           bounce.t_max)) || !spawn_further(spawn)) {
            break;
        }
    }
    bounce_store(bounce);
    next_path_store(Next_path(weight));
}
