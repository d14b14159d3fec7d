#version 330 core
// What a point brings to the texels that it covers: added up by blending.

flat in vec4 arrived;

out vec4 sum;

void main() {
    sum = arrived;
}
