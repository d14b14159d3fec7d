#version 330 core
// Shade a vertex of every path (Kajiya 1986). Write the light found there, the shadow ray towards the
// sampled light, and the path's next ray. gpgpu_rt/reference/path.py, the float64 version, names the papers
// and documents the weights.

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
#include "render/surroundings.glsl"
#include "render/walk.glsl"
#include "render/both_ways.glsl"
#include "render/sample.glsl"
#ifdef DIELECTRICS
#include "render/fresnel.glsl"
#endif
#include "render/scatter.glsl"
#ifdef SHADOWS
#include "render/luminance.glsl"
#include "render/light_end.glsl"
#ifdef ASKED_SURROUNDINGS
#include "render/asked_surroundings.glsl"
#endif
#include "render/asked_light.glsl"
#endif

uniform int vertex;         // number of the vertex; the eye is 0
uniform bool last;          // whether all paths end at this vertex
uniform int roulette;       // first vertex at which Russian roulette may end paths
uniform float most_survive; // largest probability to survive Russian roulette

// Return an endless ray that leaves the hit. The offset of the origin keeps the ray from hitting the
// triangle of the hit.
Rays leave(inout Spawn spawn, vec3 direction) {
    Rays ray = Rays(vec3(0.0), spawn_t_min(), direction, INFINITE);
    for (int tries = 0; tries < SPAWN_TRIES; ++tries) {
        ray.origin = spawn_origin(spawn);
        if (!spawn_further(spawn, spawn_hits_itself(spawn, ray))) {
            break;
        }
    }
    return ray;
}

#ifdef SHADOWS
// The sampled light that the vertex sends along the path if nothing blocks the shadow ray.
vec3 light_asked(Spawn spawn, Surface surface, Scatter scatter, vec4 random, inout Rays shadow) {
    AskedLight light = ask_light(random);
#ifdef ASKED_SURROUNDINGS
    if (light.far) {
        vec3 direction;
        vec3 arrives = surroundings_asked(surface, scatter, random, direction);
        if (max(max(arrives.r, arrives.g), arrives.b) > 0.0) {
            shadow = leave(spawn, direction);
        }
        return arrives;
    }
#endif
    vec3 to_light = light.place - spawn_origin(spawn);
    float distance = length(to_light);
    vec3 direction = stored(to_light / distance);
    float density;
    vec3 found = scattered(surface, scatter, direction, density) * light.strength;
    float facing = 1.0;
#ifdef AREA_LIGHTS
    if (light.normal != vec3(0.0)) {
        // Light sampling draws this direction with the density bright * distance^2 / facing. The path's own
        // continuation draws this direction with `density`.
        facing = abs(dot(light.normal, direction));
        float bright = light_density * luminance(light.strength);
        found *= facing * power_weight(bright * distance * distance, facing * density);
    }
#endif
    if (max(max(found.r, found.g), found.b) > 0.0) {
        shadow = leave(spawn, direction);
        // `leave` may have moved the ray's origin after the direction was computed. The ray's end then
        // moves equally far, so add the offset to the light's error.
        shadow.t_max = shadow_end(dot(light.place - shadow.origin, direction),
                                  light.blur + spawn.offset, facing);
    }
    return found;
}
#endif

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(texel);
    Hit hit = hit_load(texel);
    Walk walk = walk_load(texel);
    Rays none = Rays(vec3(0.0), 1.0, vec3(0.0, 0.0, 1.0), -1.0);
    Rays next_ray = none;
    Rays shadow = none;
    Next_walk next_walk = Next_walk(vec3(0.0), 0.0);
    vec3 lit = vec3(0.0);
    vec3 direct = vec3(0.0);
    if (ray.t_max >= 0.0 && !hit_found(hit)) {
        vec3 radiance = surroundings(ray.direction);
        lit = walk.weight * radiance;
#ifdef ASKED_SURROUNDINGS
        lit *= surroundings_share(ray.direction, radiance, walk.density);
#endif
    } else if (ray.t_max >= 0.0) {
        Surface surface = surface_at(ray, hit);
#ifdef EMITTERS
        vec3 emission = emission_radiance(surface.material);
        float share = 1.0;
#ifdef AREA_LIGHTS
        float bright = light_density * luminance(emission);
        if (walk.density > 0.0 && bright > 0.0) {
            float found = walk.density * abs(dot(surface.flat_normal, ray.direction));
            share = found * power_weight(found, bright * hit.t * hit.t);
        }
#endif
        lit = walk.weight * emission * share;
#endif
        if (!last) {
            Scatter scatter = scatter_of(surface, ray.direction);
            Spawn spawn = spawn_setup(hit, surface.flat_normal);
            vec4 random = walk_random(texel, vertex, 0u);
#ifdef SHADOWS
            vec4 light_random = walk_random(texel, vertex, 1u);
            if (light_count > 0 && scatters(scatter)) {
                direct = walk.weight * light_asked(spawn, surface, scatter, light_random, shadow);
            }
#endif
            Onward next = onward(surface, scatter, random);
            vec3 weight = walk.weight * next.weight;
            float most = max(max(weight.r, weight.g), weight.b);
            float chance = vertex >= roulette ? min(most, most_survive) : 1.0;
            if (most > 0.0 && random.y < chance) {
                next_walk = Next_walk(weight / chance, next.density);
                vec3 direction = stored(normalize(next.direction));
                spawn.normal = next.side;
                next_ray = leave(spawn, direction);
            }
        }
    }
    next_rays_store(Next_rays(next_ray.origin, next_ray.t_min, next_ray.direction,
                              next_ray.t_max));
    next_walk_store(next_walk);
    lit_store(Lit(lit));
#ifdef SHADOWS
    shadow_rays_store(Shadow_rays(shadow.origin, shadow.t_min, shadow.direction, shadow.t_max));
    direct_store(Direct(direct));
#endif
}
