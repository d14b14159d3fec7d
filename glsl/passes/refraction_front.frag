#version 330 core
// Second pass of image-space refraction (Wyman, "An Approximate Image-Space Approach for Interactive
// Refraction", 2005; survey, section 5; fact sheet G3): light is refracted where it enters, leaves
// about where a blend of two thicknesses says, one along the eye ray and one against the normal, and is
// refracted there by the normal that the first pass shows at that place.
//
// Departure: past the critical angle light is reflected once and then leaves, and where the place
// lies outside what the first pass drew it goes on as it is; `kind` tells both from a proper exit.

#include "common/cover.glsl"

in vec3 place;
in vec3 blended;
in float inward;

uniform sampler2D back_faces;
uniform float ior;

out vec4 leaving;    // direction, and kind as in rasterised/refraction.py

void main() {
    if (gl_FrontFacing) {
        discard;
    }
    vec3 view = normalize(place - eye);
    vec3 normal = normalize(blended);
    float cosine = clamp(-dot(view, normal), 0.0, 1.0);
    vec3 inside = refract(view, normal, 1.0 / ior);
    float entering = acos(cosine);
    float refracted = acos(clamp(-dot(inside, normal), 0.0, 1.0));
    float share = entering > 1e-3 ? refracted / entering : 1.0 / ior;
    float far = texelFetch(back_faces, ivec2(gl_FragCoord.xy), 0).w;
    float along = far > 0.0 ? max(far - distance(place, eye), 0.0) : inward;
    vec4 exit = clip_place(place + mix(inward, along, share) * inside);
    ivec2 pixel = ivec2(floor((exit.xy / exit.w * 0.5 + 0.5) * size));
    bool seen = min(pixel.x, pixel.y) >= 0 && pixel.x < int(size.x) && pixel.y < int(size.y);
    vec4 back = seen ? texelFetch(back_faces, pixel, 0) : vec4(0.0);
    if (back.w == 0.0) {
        leaving = vec4(inside, 2.0);
        return;
    }
    vec3 outside = refract(inside, -back.xyz, ior);
    bool total = outside == vec3(0.0);
    leaving = vec4(total ? reflect(inside, -back.xyz) : outside, total ? 3.0 : 1.0);
}
