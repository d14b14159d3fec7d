#version 330 core
// First pass of image-space refraction: write the normal of the farthest surface that faces away, and its
// distance along the eye ray. The image has row 0 at the top, which reverses every winding: GL's front
// faces show their backs.

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
