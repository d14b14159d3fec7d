#version 330 core
// Second pass of image-space refraction (Wyman, "An Approximate Image-Space Approach for Interactive
// Refraction", 2005; survey, section 5): light is refracted where it enters, leaves about where a blend
// of two thicknesses says, one along the eye ray and one against the normal, and is refracted there by
// the normal that the first pass shows at that place.
//
// Departure: past the critical angle light is reflected once and then leaves, and where the place
// lies outside what the first pass drew it goes on as it is; `kind` tells both from a proper exit.

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
