#version 330 core
// Start each path with an eye ray through a random position in its pixel.

#include "core/precision.glsl"
#include <streams>
#include "render/walk.glsl"
#include "drivers/eye.glsl"

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec2 place = vec2(walk_pixel(texel)) + walk_random(texel, 0, 0u).zw;
    bool real = walk_sample(texel) < samples;
    Rays ray = eye_ray(place);
    ray.t_max = real ? ray.t_max : -1.0;
    rays_store(ray);
    walk_store(Walk(vec3(real ? 1.0 : 0.0), 0.0));
}
