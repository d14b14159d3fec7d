#version 330 core
// Covers a target with one fragment for each ray. It draws either one large triangle over the whole target,
// or the rectangles that hold live rays. Every program must compute exactly the same depth: one program
// writes a depth mask of rays, and the depth test compares the fragments of other programs with the mask.

in vec4 rectangle;     // lower and upper corner, in rays
uniform vec2 scale;    // clip units per ray
uniform float depth;   // in [-1, 1]

invariant gl_Position;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(mix(rectangle.xy, rectangle.zw, corner) * scale - 1.0, depth, 1.0);
}
