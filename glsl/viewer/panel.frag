#version 330 core
// Shade the panels, the graphs and the picture in the viewer's window.

in vec2 at;
in vec4 colour;
uniform sampler2D picture;
out vec4 shown;

void main() {
    shown = colour * texture(picture, at);
}
