#version 330 core
// Shading (Purcell et al. 2002, the last of their four kernels): what a point light (no falloff) and a
// little ambient light give each hit, and the shadow ray that finds out whether the light arrives.

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

uniform vec3 light_position;
uniform vec3 light_intensity;

// A shadow ray ends before the light by as much as its end is off: five roundings for the distance,
// one for the direction, and six with which a surface there is seen (its vertices' and the shear's);
// then direction and end are stored.
const float LIGHT_ERROR = 12.0 * ARITHMETIC_UNIT + 4.0 * STORAGE_UNIT;

vec3 sky(vec3 direction) {
    return mix(vec3(0.86, 0.88, 0.90), vec3(0.42, 0.55, 0.72), smoothstep(-0.3, 0.9, direction.y));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    Hit hit = hit_load(pixel);
    if (!hit_found(hit)) {
        lit_store(Lit(sky(ray.direction), vec3(0.0)));
        shadow_rays_store(Shadow_rays(vec3(0.0), 1.0, vec3(0.0, 0.0, 1.0), -1.0));   // no ray
        return;
    }
    vec3 normal = surface_normal(hit.triangle);
    normal = dot(normal, ray.direction) > 0.0 ? -normal : normal;
    Spawn spawn = spawn_setup(hit, normal);
    Rays shadow;
    shadow.t_min = spawn_t_min();
    float distance;
    for (int tries = 0; tries < SPAWN_TRIES; ++tries) {
        shadow.origin = spawn_origin(spawn);
        vec3 to_light = light_position - shadow.origin;
        distance = length(to_light);
        shadow.direction = stored(to_light / distance);
        shadow.t_max = distance * (1.0 - LIGHT_ERROR);
        // A surface that faces away from the light needs no ray.
        if (dot(normal, shadow.direction) <= 0.0 || !spawn_hits_itself(spawn, shadow)
                || !spawn_further(spawn)) {
            break;
        }
    }
    float cosine = max(dot(normal, shadow.direction), 0.0);
    vec3 diffuse = surface_diffuse(hit.triangle);
    vec3 ambient = mix(vec3(0.16, 0.14, 0.12), vec3(0.26, 0.29, 0.33), 0.5 + 0.5 * normal.y)
                 * (0.7 + 0.3 * max(dot(normal, -ray.direction), 0.0));
    lit_store(Lit(diffuse * ambient, diffuse * light_intensity * cosine));
    shadow_rays_store(Shadow_rays(shadow.origin, shadow.t_min, shadow.direction,
                                  cosine > 0.0 ? shadow.t_max : -1.0));
}
