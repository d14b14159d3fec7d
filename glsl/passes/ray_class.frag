#version 330 core
// Writes which five-dimensional box each ray lies in: what the host makes lists for.

#include "common/precision.glsl"
#include "common/fetch.glsl"
#include <streams>
#include "common/slack.glsl"
#include "common/ray.glsl"
#include "common/box.glsl"
#include "common/ray_class.glsl"

void main() {
    Ray ray = ray_setup(rays_load(ivec2(gl_FragCoord.xy)));
    ray_class_store(Ray_class(box_of(ray)));
}
