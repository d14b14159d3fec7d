#version 330 core
// Shading (Purcell et al. 2002, the last of their four kernels). For one light source, write two results
// for each hit: the light that the hit reflects if it is not in shadow, and the shadow ray towards the
// source. A source is a point light (without falloff) or a point on an emitting triangle. This pass is
// drawn once per source. Only the first draw writes the light that needs no shadow ray: light from the
// surroundings, and emitted light.

#include "core/fetch.glsl"
#include "core/precision.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "render/surface.glsl"
#include "render/surroundings.glsl"
#ifdef SHADOWS
#include "core/triangle.glsl"
#include "render/spawn.glsl"
#include "render/light.glsl"
#endif
#ifdef BOUNCES
#ifdef DIELECTRICS
#include "render/fresnel.glsl"
#endif
#include "render/onward.glsl"

uniform bool last_wave;     // whether the limit of bounces is reached, so that no rays continue

// At the last bounce, sum the surroundings' light over the rays that render/branch.frag would make.
vec3 surroundings_beyond(Surface surface, vec3 incoming, vec3 weight) {
    vec3 light = vec3(0.0);
    for (int k = 0; k < 2; ++k) {
        Onward on = onward(surface, incoming, k == 1);
        vec3 rest = weight * on.share;
        if (max(max(rest.r, rest.g), rest.b) >= CUTOFF) {
            light += on.share * surroundings(on.direction);
        }
    }
    return light;
}
#endif

#ifdef MANY_LIGHTS
uniform bool further_light;
#else
const bool further_light = false;
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    Hit hit = hit_load(pixel);
    if (!hit_found(hit)) {
        lit_store(Lit(further_light ? vec3(0.0) : surroundings(ray.direction)));
#ifdef SHADOWS
        direct_store(Direct(vec3(0.0)));
        shadow_rays_store(Shadow_rays(vec3(0.0), 1.0, vec3(0.0, 0.0, 1.0), -1.0));   // no ray
#endif
        return;
    }
    Surface surface = surface_at(ray, hit);
    PRECISE vec3 ambient = surface.diffuse * ambient_light(surface.normal, ray.direction);
#ifdef EMITTERS
    ambient += emission_radiance(surface.material);
#endif
#ifdef BOUNCES
    if (last_wave) {
        ambient += surroundings_beyond(surface, ray.direction, path_load(pixel).weight);
    }
#endif
    lit_store(Lit(further_light ? vec3(0.0) : ambient));
#ifdef SHADOWS
    light_surface(ray, hit, surface, pixel);
#endif
}
