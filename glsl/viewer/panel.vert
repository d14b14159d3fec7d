#version 330 core
// Moves vertices of panels, graphs and picture from window units, (0, 0) at the upper left, to clip space.

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
