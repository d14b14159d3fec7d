#version 330 core
// Draws one rectangle for each triangle (each instance), over all image tiles that may show this triangle.
// If the depth of a vertex is at most 1 % of the farthest vertex's distance from the eye, the rectangle
// covers the whole image. A triangle wholly behind the eye is not drawn.

#include <table_width>
#include "core/fetch.glsl"
#include <tables>
#include "stages/eye_triangle.glsl"

uniform vec2 tiles;
uniform float tile;     // pixels per side

flat out vec3 corner_a;
flat out vec3 corner_b;
flat out vec3 corner_c;

// Project a vertex in front of the eye, to pixels.
vec2 projected(vec3 corner) {
    float z = dot(corner, forward);
    vec2 at = vec2(dot(corner, right) / dot(right, right), -dot(corner, up) / dot(up, up)) / z;
    return (0.5 * at + 0.5) * image;
}

void main() {
    int i = gl_InstanceID;
    corner_a = triangle_v0(i) - eye;
    corner_b = triangle_v1(i) - eye;
    corner_c = triangle_v2(i) - eye;
    float size = farthest(corner_a, corner_b, corner_c);
    vec3 z = depths(corner_a, corner_b, corner_c);
    vec2 lo = vec2(0.0);
    vec2 hi = tiles;
    if (least(z) > 0.01 * size) {
        vec2 a = projected(corner_a);
        vec2 b = projected(corner_b);
        vec2 c = projected(corner_c);
        // Rounding acts like a displacement d = MARGIN * size of a vertex (eye_triangle.glsl). Image
        // coordinates are in [-1, 1]. So d across the view moves the projected vertex by d / (slope * z),
        // and d along the view moves it by at most d / z. Here d is small: size < 100 z.
        vec2 slope = vec2(length(right), length(up));
        vec2 wider = 0.5 * image * MARGIN * size / least(z) * (1.0 / slope + 1.0) * 2.0 + 0.01;
        lo = clamp(floor((min(min(a, b), c) - wider) / tile), vec2(0.0), tiles);
        hi = clamp(ceil((max(max(a, b), c) + wider) / tile), vec2(0.0), tiles);
    }
    vec2 place = mix(lo, hi, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    gl_Position = vec4(2.0 * place / tiles - 1.0, 0.0, 1.0);
    if (most(z) < -MARGIN * size) {
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    }
}
