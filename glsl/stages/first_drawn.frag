#version 330 core
// The row of the triangle that the depth test leaves nearest: a candidate, no more.

flat in float drawn;

out float candidate;

void main() {
    candidate = drawn;
}
