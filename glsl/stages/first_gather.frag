#version 330 core
// Gathers the eye rays for which the rasteriser's hit is in doubt. Texels after the last ray get an empty
// interval.

#include "core/precision.glsl"
#include <streams>

uniform sampler2D places;      // positions of the rays, counted row by row; -1 for no ray
uniform int image_width;

void main() {
    int place = int(texelFetch(places, ivec2(gl_FragCoord.xy), 0).x);
    Rays ray = rays_load(ivec2(max(place, 0) % image_width, max(place, 0) / image_width));
    if (place < 0) {
        ray = Rays(ray.origin, 1.0, ray.direction, -1.0);
    }
    rays_store(ray);
}
