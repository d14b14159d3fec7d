// Computes direct light from one light: the shadow ray, and the light that arrives if nothing blocks the
// ray.

uniform vec3 light_position;    // position of a point light, or first corner of an emitting triangle
uniform vec3 light_intensity;   // for a triangle: radiance * area * (weight of the sample point) / pi

#include "render/light_end.glsl"
#if defined(AREA_LIGHTS) || defined(GLOSSY)
#include "render/sample.glsl"
#endif

#ifdef AREA_LIGHTS
#include "render/random.glsl"

uniform bool light_is_area;
uniform vec3 light_edge_u;      // edges from the first corner to the second and third
uniform vec3 light_edge_v;
uniform vec2 light_place;       // sample point in the unit square, the same for all pixels
uniform ivec2 corner;           // corner of the drawn region, in pixels of the picture

// All pixels use the same sample points, shifted around the unit square by random numbers of the pixel
// (Cranley and Patterson 1976). The shift turns the edges of the sample points' shadows into noise.
vec3 place_on_light(ivec2 pixel) {
    vec2 moved = random_numbers(random_counter(uvec2(corner + pixel), 0u, 0u, 0u, 0u)).xy;
    vec2 uv = sample_triangle(fract(light_place + moved));
    return light_position + uv.x * light_edge_u + uv.y * light_edge_v;
}
#endif

#ifdef GLOSSY
// An energy-conserving lobe around the mirror direction (Lafortune and Willems 1994). The lobe is
// multiplied by pi, because light intensities are irradiances divided by pi.
vec3 glossy_light(Surface surface, vec3 to_light, vec3 direction) {
    float exponent = glossy_exponent(surface.material);
    float cosine = dot(to_light, reflect(direction, surface.normal));
    return glossy_share(surface.material) * (SAMPLE_PI * (exponent + 2.0) / (exponent + 1.0)
                                             * lobe_density(cosine, exponent));
}
#endif

void light_surface(Rays ray, Hit hit, Surface surface, ivec2 pixel) {
    vec3 place = light_position;
#ifdef AREA_LIGHTS
    if (light_is_area) {
        place = place_on_light(pixel);
    }
#endif
    Spawn spawn = spawn_setup(hit, surface.flat_normal);
    Rays shadow;
    shadow.t_min = spawn_t_min();
    float distance;
    for (int tries = 0; tries < SPAWN_TRIES; ++tries) {
        shadow.origin = spawn_origin(spawn);
        vec3 to_light = place - shadow.origin;
        distance = length(to_light);
        shadow.direction = stored(to_light / distance);
        shadow.t_max = shadow_end(distance, 0.0, 1.0);
        // A surface that faces away from the light needs no ray.
        bool faces_away = dot(surface.flat_normal, shadow.direction) <= 0.0;
        if (!spawn_further(spawn, !faces_away && spawn_hits_itself(spawn, shadow))) {
            break;
        }
    }
    float cosine = max(dot(surface.normal, shadow.direction), 0.0);
#ifdef SMOOTH_NORMALS
    cosine = dot(surface.flat_normal, shadow.direction) <= 0.0 ? 0.0 : cosine;
#endif
    float falloff = 1.0;
#ifdef AREA_LIGHTS
    if (light_is_area) {
        vec3 normal = normalize(cross(light_edge_u, light_edge_v));
        float facing = abs(dot(normal, shadow.direction));   // both sides emit
        falloff = facing / (distance * distance);
        shadow.t_max = shadow_end(distance, place_error(place, light_edge_u, light_edge_v), facing);
        cosine = facing > 0.0 ? cosine : 0.0;
    }
#endif
    PRECISE vec3 reflected = surface.diffuse;
#ifdef GLOSSY
    reflected += glossy_light(surface, shadow.direction, ray.direction);
#endif
    PRECISE vec3 direct = reflected * light_intensity * cosine * falloff;
    direct_store(Direct(direct));
    shadow_rays_store(Shadow_rays(shadow.origin, shadow.t_min, shadow.direction,
                                  cosine > 0.0 ? shadow.t_max : -1.0));
}
