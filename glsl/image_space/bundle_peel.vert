#version 330 core
// Projects a corner of a triangle along the bundle's direction (see bundle_peel.frag).

#include <constants>
#include "core/fetch.glsl"
#include <tables>
#include "image_space/parallel.glsl"

out float depth;
flat out vec2 slope;
flat out int side;

void main() {
    int row = gl_VertexID / 3;
    int corner = gl_VertexID % 3;
    vec3 v0 = triangle_v0(row);
    vec3 v1 = triangle_v1(row);
    vec3 v2 = triangle_v2(row);
    vec3 normal = cross(v1 - v0, v2 - v0);
    float ahead = dot(normal, along);
    slope = ahead == 0.0 ? vec2(0.0)
        : -pixel_size / ahead * vec2(dot(normal, across), dot(normal, upward));
    side = 2 * row + (ahead < 0.0 ? 0 : 1);
    vec3 at = projected(corner == 0 ? v0 : corner == 1 ? v1 : v2);
    depth = at.z;
    gl_Position = vec4(2.0 * at.xy / resolution - 1.0, at.z / reach - 1.0, 1.0);
}
