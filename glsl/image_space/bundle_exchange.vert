#version 330 core
// Neighbouring layers of a bundle light each other (Szirmay-Kalos 1998; survey, section 5): two points
// a pixel, one for what the nearer layer gets of the one behind it and one for the other way, go to
// the texel of the side that gets it and are added up there. A pixel is a tube of rays: the flux in it
// is radiance * solid angle * the pixel's area, whatever the surface's slope.
//
// Departure: the paper draws one direction at random an iteration and averages; directions are a fixed
// set here, and each bounce goes through all of them. Beside the light goes the weight that the tubes
// gave a side, to be divided by: it should be pi.

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
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);    // nobody there
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
