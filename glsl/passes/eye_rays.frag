#version 330 core
// Eye rays through the pixel centres (Purcell et al. 2002, the first of their four kernels).

#include "common/precision.glsl"
#include <streams>
#include "common/eye.glsl"

void main() {
    rays_store(eye_ray(gl_FragCoord.xy));
}
