#version 330 core
// Second pass of image-space refraction (Wyman, "An Approximate Image-Space Approach for Interactive
// Refraction", 2005; survey, section 5): refract light at the entry; estimate the exit by a blend of
// two thicknesses, along the eye ray and against the normal; refract there by the normal that the first
// pass shows at the exit.
//
// Departure: past the critical angle light is reflected once and then leaves. Where the exit lies outside
// the image of the first pass, light continues unrefracted. `kind` distinguishes both cases from a proper
// exit.

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
