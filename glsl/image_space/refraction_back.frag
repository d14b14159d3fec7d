#version 330 core
// First pass of image-space refraction: normals of the farthest surface that faces away, and how far
// along the eye ray it is. The image has row 0 at the top, which turns every triangle: those that GL
// takes for front faces show their backs.

#include "stages/cover.glsl"

in vec3 place;
in vec3 blended;

out vec4 back;

void main() {
    if (!gl_FrontFacing) {
        discard;
    }
    back = vec4(normalize(blended), distance(place, eye));
}
