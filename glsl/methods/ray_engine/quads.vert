#version 330 core
// Draws a triangle as a quad over a batch's rays: Carr, Hall, Hart 2002 (see
// methods/ray_engine/ray_engine.glsl).

#include "core/precision.glsl"
#include <table_width>
#include "core/fetch.glsl"
#include <tables>

in vec4 rectangle;   // lower and upper corner, in rays
in int row;          // row of the triangle table
uniform vec2 scale;  // clip units per ray

flat out int quad_triangle;
flat out vec3 quad_v0;
flat out vec3 quad_v1;
flat out vec3 quad_v2;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(mix(rectangle.xy, rectangle.zw, corner) * scale - 1.0, 0.0, 1.0);
    quad_triangle = triangle_index(row);
    quad_v0 = triangle_v0(row);
    quad_v1 = triangle_v1(row);
    quad_v2 = triangle_v2(row);
}
