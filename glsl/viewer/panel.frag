#version 330 core
// Panels, graphs and the picture itself in the viewer's window.

in vec2 at;
in vec4 colour;
uniform sampler2D picture;
out vec4 shown;

void main() {
    shown = colour * texture(picture, at);
}
