#version 330 core
// Writes the table row of the triangle that the depth test finds nearest: a candidate for the hit.

flat in float drawn;

out float candidate;

void main() {
    candidate = drawn;
}
