#version 330 core
// Projects a corner of a mesh that refracts light (refraction_front.frag) or casts a caustic
// (caustic_photons.frag).

#include "stages/cover.glsl"

in vec3 corner;
in vec3 normal;
in float inner;     // thickness of the mesh at this corner, measured opposite to the normal's direction

out vec3 place;
out vec3 blended;
out float inward;

void main() {
    place = corner;
    blended = normal;
    inward = inner;
    gl_Position = clip_place(corner);
}
