#version 330 core
// What a traced eye ray came to goes to its place in the image: a point a ray.

in int place;

uniform ivec2 image;
uniform int row_length;    // of the traced rays

flat out ivec2 source;

void main() {
    source = ivec2(gl_VertexID % row_length, gl_VertexID / row_length);
    vec2 pixel = vec2(place % image.x, place / image.x) + 0.5;
    gl_Position = vec4(2.0 * pixel / vec2(image) - 1.0, 0.0, 1.0);
}
