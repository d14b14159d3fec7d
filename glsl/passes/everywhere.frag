#version 330 core
// Writes nothing: what an occlusion query counts is what the depth test lets through.

void main() {
}
