#version 330 core
// A bundle of parallel rays as a picture (survey, section 5): a parallel projection along the
// bundle's direction, its layers peeled off one after another. What lies no deeper than the layer
// before is thrown away here, of the rest the depth test keeps the nearest. Szirmay-Kalos and
// Purgathofer, "Global Ray-bundle Tracing with Hardware Acceleration", 1998; Hachisuka, "High-Quality
// Global Illumination Rendering Using Rasterization", GPU Gems 2, chapter 38, 2005.
//
// A layer is compared in float32 with what the same triangle gave one pass before, which is the same
// bits. Triangles that coincide are one layer: the other one is lost.

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
