#version 330 core
// First pass of image-space refraction: write the normal of the farthest back-facing surface, and the
// surface's distance along the eye ray. Row 0 of the image is at the top, which reverses every winding:
// GL's front faces are the back faces.

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
