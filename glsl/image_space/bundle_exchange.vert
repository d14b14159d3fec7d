#version 330 core
// Exchange light between neighbouring layers of a bundle of parallel rays (Szirmay-Kalos 1998; survey,
// section 5). Each pixel draws two points: the first carries light from the nearer layer to the farther
// layer, the second carries light back. A point goes to the texel of the receiving side of a triangle, and
// blending adds the light there. The flux through a pixel is radiance * solid angle * the pixel's area. It
// does not depend on the slope of the surface.
//
// Departure: the paper draws a random direction in each iteration and averages the results. Here the set of
// directions is fixed, and each bounce runs through all directions. The fourth channel sums the factors of
// the radiances that a side received. Infinitely many directions would give the sum pi. The host
// (ray_bundles.py) therefore scales the light by pi / sum.

#include <constants>
#include "core/fetch.glsl"
#include <tables>
#include <streams>
#include "image_space/parallel.glsl"
#include "image_space/bundle_light.glsl"

uniform float target_rows;

flat out vec4 arrived;

void main() {
    int element = gl_VertexID >> 1;
    ivec2 pixel = ivec2(element % int(resolution), element / int(resolution));
    int before = nearer_load(pixel).side;
    int behind = layer_load(pixel).side;
    bool backwards = (gl_VertexID & 1) == 1;
    if ((backwards ? before : behind) < 0) {
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);    // no receiving layer
        arrived = vec4(0.0);
        return;
    }
    int side = backwards ? before ^ 1 : behind;
    vec3 radiance = backwards ? seen_from_before(behind) : seen_from_behind(before);
    int row = side >> 1;
    vec3 v0 = triangle_v0(row);
    float area = 0.5 * length(cross(triangle_v1(row) - v0, triangle_v2(row) - v0));
    arrived = vec4(radiance, 1.0) * weight * pixel_size * pixel_size / area;
    vec2 texel = vec2(table_texel(side)) + 0.5;
    gl_Position = vec4(2.0 * texel / vec2(float(1 << TABLE_WIDTH_LOG2), target_rows) - 1.0, 0.0, 1.0);
}
