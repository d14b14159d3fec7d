#version 330 core
// Ray origins as a stream, to be reduced to the box that they lie in: as they are, or with MINUS
// negated, so that one reduction by minimum serves both corners. Empty rays bound nothing.

#include "core/precision.glsl"
#include <streams>
#include "core/stream.glsl"

uniform ivec2 ray_texture_size;

void main() {
    int i = element();
    Rays ray = rays_load(ivec2(i % ray_texture_size.x, i / ray_texture_size.x));
#ifdef MINUS
    ray.origin = -ray.origin;
#endif
    bool empty = !(ray.t_min <= ray.t_max);
    values_store(Values(vec4(empty ? vec3(3.402823466e38) : ray.origin, 0.0)));
}
