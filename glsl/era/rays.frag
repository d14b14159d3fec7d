#version 330 core
// Writes the rays into textures (first stage of Purcell et al. 2002). A component of a direction nearer to
// zero than TINY becomes TINY or -TINY, so that no later kernel multiplies zero by an infinite inverse.

#include "core/precision.glsl"
#include <streams>

const float TINY = 1e-18;   // fp24 holds this number

layout(location = 0) out vec4 target_0;
layout(location = 1) out vec4 target_1;

float nonzero(float x) {
    return abs(x) < TINY ? (x < 0.0 ? -TINY : TINY) : x;
}

void main() {
    Rays ray = rays_load(ivec2(gl_FragCoord.xy));
    vec3 d = ray.direction;
    target_0 = vec4(ray.origin, ray.t_min);
    target_1 = vec4(nonzero(d.x), nonzero(d.y), nonzero(d.z), ray.t_max);
}
