#version 330 core
// Writes the number of the five-dimensional box in which each ray lies. The host lists the triangles for
// each box.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/box.glsl"
#include "methods/ray_space/ray_class.glsl"

void main() {
    Ray ray = ray_setup(rays_load(ivec2(gl_FragCoord.xy)));
    ray_class_store(Ray_class(box_of(ray)));
}
