#version 330 core
// In an image from the light, emit a photon at each pixel with a refractor or mirror (Shah, Konttinen
// and Pattanaik, "Caustics Mapping: An Image-Space Technique for Real-Time Caustics", TVCG 2007; survey,
// section 5). Write the photon's exit point, direction and flux. BORDERS is 0 for a mirror, 1 for a surface
// with another medium behind it, and 2 for a closed mesh. As in the paper, image-space refraction finds a
// photon's way through a closed mesh.
//
// Departures: a photon carries the flux of its pixel's solid angle; the paper divides the light evenly
// among visible pixels. Flux that a refractor reflects (Fresnel's equations) is subtracted. A photon is
// dropped if it finds no exit or is totally reflected inside.

#include "stages/cover.glsl"
#include "render/fresnel.glsl"
#if BORDERS == 2
#include "image_space/image_refraction.glsl"
#elif BORDERS == 1
uniform float ior;
#else
uniform float reflectance;
#endif

in vec3 place;
in vec3 blended;
in float inward;

layout(location = 0) out vec4 leaving;    // direction, and flux for a light of one watt per steradian
layout(location = 1) out vec4 start;

void main() {
    vec3 view = normalize(place - eye);
    vec3 normal = normalize(blended);
    float slanted = slant(gl_FragCoord.xy);
    float flux = 4.0 * length(right) * length(up) / (size.x * size.y * slanted * slanted * slanted);
    start = vec4(place, 1.0);
#if BORDERS == 2
    if (gl_FrontFacing) {
        discard;
    }
    Through found = through_both(place, normal, inward);
    flux *= 1.0 - fresnel(clamp(-dot(view, normal), 0.0, 1.0), ior);
    flux *= 1.0 - fresnel(clamp(dot(found.inside, found.normal), 0.0, 1.0), 1.0 / ior);
    leaving = vec4(found.outside, found.kind == LEFT ? flux : 0.0);
    start.xyz = found.exit;
#else
    float into = dot(view, normal);
    vec3 towards = into < 0.0 ? normal : -normal;
#if BORDERS == 1
    float behind = into < 0.0 ? ior : 1.0 / ior;
    float share = 1.0 - fresnel(abs(into), behind);
    leaving = vec4(refract(view, towards, 1.0 / behind), share * flux);
#else
    leaving = vec4(reflect(view, towards), reflectance * flux);
#endif
#endif
}
