#version 330 core
// Shading (Purcell et al. 2002, the last of their four kernels): what a point light (no falloff) and a
// little ambient light give each hit, and the shadow ray that finds out whether the light arrives.

#include "common/fetch.glsl"
#include "common/precision.glsl"
#include <streams>
#include <tables>
#include "common/hit.glsl"

uniform vec3 light_position;
uniform vec3 light_intensity;

// The hit point is known to a few ulp of the coordinates it was computed from: 32 of them clear
// the surface, whatever the scene's size.
const float OFFSET_ULPS = 32.0 / 8388608.0;

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
    vec3 travel = hit.t * ray.direction;
    vec3 size = abs(ray.origin) + abs(travel);
    vec3 point = ray.origin + travel + normal * OFFSET_ULPS * max(max(size.x, size.y), size.z);

    vec3 to_light = light_position - point;
    float distance = length(to_light);
    vec3 direction = to_light / distance;
    float cosine = max(dot(normal, direction), 0.0);
    vec3 diffuse = surface_diffuse(hit.triangle);
    vec3 ambient = mix(vec3(0.16, 0.14, 0.12), vec3(0.26, 0.29, 0.33), 0.5 + 0.5 * normal.y)
                 * (0.7 + 0.3 * max(dot(normal, -ray.direction), 0.0));
    lit_store(Lit(diffuse * ambient, diffuse * light_intensity * cosine));
    // Surfaces that face away from the light need no ray.
    shadow_rays_store(Shadow_rays(point, 0.0, direction, cosine > 0.0 ? distance : -1.0));
}
