#version 330 core
// Peel the next layer of a bundle of parallel rays: discard surfaces that are not deeper than the previous
// layer; the depth test keeps the nearest of the remaining surfaces. Szirmay-Kalos and Purgathofer, "Global
// Ray-bundle Tracing with Hardware Acceleration", 1998; Hachisuka, "High-Quality Global Illumination
// Rendering Using Rasterization", GPU Gems 2, chapter 38, 2005; survey, section 5.
//
// The comparison is exact, since a triangle gives the same float32 depth in each pass. Coincident triangles
// form a single layer: only one of these triangles is kept.

#include <streams>

in float depth;
flat in vec2 slope;
flat in int side;

void main() {
    if (!(depth > nearer_load(ivec2(gl_FragCoord.xy)).depth)) {
        discard;
    }
    layer_store(Layer(depth, slope, side));
}
