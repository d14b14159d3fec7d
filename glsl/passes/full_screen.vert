#version 330 core
// One triangle that covers the whole target: a fragment for every ray. Its depth is what masks
// are written with and tested against, so it must come out the same in every program.

uniform float depth;   // in [-1, 1]

invariant gl_Position;

void main() {
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(2.0 * corner - 1.0, depth, 1.0);
}
