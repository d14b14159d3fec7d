#version 330 core
// Adds rays to the stream (ray_stream.glsl), at the root of the tree.

#include "core/stream.glsl"
#include <streams>

uniform int base;        // the first element that is drawn
uniform int first_ray;
uniform int width;       // rays in a row
uniform int root;

void main() {
    int ray = first_ray + element() - base;
    ivec2 pixel = ivec2(ray % width, ray / width);
    queued_store(Queued(root, pixel.x, pixel.y, rays_load(pixel).t_min));
}
