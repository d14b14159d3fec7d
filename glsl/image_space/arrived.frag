#version 330 core
// Write a point's light to the texels that it covers; blending adds the light of all points.

flat in vec4 arrived;

out vec4 sum;

void main() {
    sum = arrived;
}
