#version 330 core
// Second pass of image-space refraction (Wyman, "An Approximate Image-Space Approach for Interactive
// Refraction", 2005; survey, section 5): refract light where it enters the mesh. Estimate the distance to
// the exit point: blend two thicknesses of the mesh, one along the eye ray and one against the normal. At
// the exit, refract light with the normal that the first pass wrote there.
//
// Departure: beyond the critical angle, light is reflected once and then leaves. If the exit lies outside
// the image of the first pass, light leaves unrefracted. `kind` marks these two cases.

#include "stages/cover.glsl"
#include "image_space/image_refraction.glsl"

in vec3 place;
in vec3 blended;
in float inward;

out vec4 leaving;    // direction, and kind

void main() {
    if (gl_FrontFacing) {
        discard;
    }
    Through found = through_both(place, normalize(blended), inward);
    leaving = vec4(found.outside, found.kind);
}
