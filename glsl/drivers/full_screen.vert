#version 330 core
// Covers a target with fragments, one a ray: all of it by one large triangle, or the rectangles
// that hold rays still alive. The depth is what masks are written with and tested against, so it
// must come out the same in every program.

in vec4 rectangle;     // lower and upper corner, in rays
uniform vec2 scale;    // clip units a ray
uniform float depth;   // in [-1, 1]

invariant gl_Position;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(mix(rectangle.xy, rectangle.zw, corner) * scale - 1.0, depth, 1.0);
}
