#version 330 core
// Place the triangles of panels, graphs and picture in window units; (0, 0) is the upper left corner.

in vec2 position;
in vec2 place;      // texture coordinates in [0, 1]
in vec4 tint;
uniform vec2 window;    // size of the window
out vec2 at;
out vec4 colour;

void main() {
    at = place;
    colour = tint;
    gl_Position = vec4(vec2(2.0, -2.0) * position / window + vec2(-1.0, 1.0), 0.0, 1.0);
}
