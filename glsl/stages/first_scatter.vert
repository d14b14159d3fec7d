#version 330 core
// Sends the result of each traced eye ray, as one point, to the ray's pixel (number `place`).

in int place;

uniform ivec2 image;
uniform int row_length;    // traced rays per row

flat out ivec2 source;

void main() {
    source = ivec2(gl_VertexID % row_length, gl_VertexID / row_length);
    vec2 pixel = vec2(place % image.x, place / image.x) + 0.5;
    gl_Position = vec4(2.0 * pixel / vec2(image) - 1.0, 0.0, 1.0);
}
