#version 330 core
// Writes the ray origins into a stream. The stream's minimum is the lower corner of the origins' box. With
// MINUS, the origins are negated: the minimum is the negated upper corner. Empty rays do not count.

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
