#version 330 core
// Find where a photon lands in the light's image, and draw a point there (Shah, Konttinen and Pattanaik
// 2007; survey, section 5). The photon leaves the refractor at V along T. Guess a distance d from V. Look
// up the receiver that the light sees in the direction of V + d T. Use this receiver's distance from V as
// the next guess, and repeat. Blending adds up the light of the points; the sum is the caustic map.
//
// Departures: the first guess is d = 0 instead of one unit, so that the scene's scale does not matter. A
// photon is dropped if another surface blocks its way to the refractor, or if it leaves the light's image.
// With KNOWN, `landed` holds the landing points, for example of traced rays. With HOME, each landing point
// is written to the photon's own texel, for readback.

#include <constants>
#include "stages/cover.glsl"

uniform int photons;      // photons per side of the photon image
#ifdef KNOWN
uniform sampler2D landed;
#else
uniform sampler2D leaving;
uniform sampler2D start;
uniform sampler2D receivers;
uniform int iterations;
#endif
#ifndef HOME
uniform float splat;      // side of a point, in pixels
#endif

flat out vec4 arrived;

// The texel of the light's image that shows a point.
vec2 seen_at(vec3 place) {
    vec4 clip = clip_place(place);
    return clip.w >= nearest ? (clip.xy / clip.w * 0.5 + 0.5) * size : vec2(-1.0);
}

bool in_image(vec2 at) {
    return min(at.x, at.y) >= 0.0 && at.x < size.x && at.y < size.y;
}

#ifndef KNOWN
vec4 receiver_behind(vec3 place) {
    vec2 at = seen_at(place);
    return in_image(at) ? texelFetch(receivers, ivec2(at), 0) : vec4(0.0);
}

// The landing point of a photon, and the photon's flux. The flux is 0 if the photon is lost.
vec4 landing(ivec2 texel) {
    vec4 away = texelFetch(leaving, texel, 0);
    vec3 from = texelFetch(start, texel, 0).xyz;
    vec4 there = receiver_behind(from);
    if (away.w == 0.0 || distance(there.xyz, eye) < 0.999 * distance(from, eye)) {
        return vec4(0.0);
    }
    vec3 at = from;
    for (int i = 0; i < iterations && there.w > 0.0; ++i) {
        at = from + distance(from, there.xyz) * away.xyz;
        there = receiver_behind(at);
    }
    return there.w > 0.0 ? vec4(at, away.w) : vec4(0.0);
}
#endif

void main() {
    ivec2 texel = ivec2(gl_VertexID % photons, gl_VertexID / photons);
#ifdef KNOWN
    vec4 photon = texelFetch(landed, texel, 0);
#else
    vec4 photon = landing(texel);
#endif
#ifdef HOME
    gl_Position = vec4((2.0 * vec2(texel) + 1.0) / float(photons) - 1.0, 0.0, 1.0);
    gl_PointSize = 1.0;
    arrived = photon;
#else
    vec2 at = seen_at(photon.xyz);
    bool lands = photon.w > 0.0 && in_image(at);
    gl_Position = vec4(lands ? 2.0 * at / size - 1.0 : vec2(2.0), 0.0, 1.0);
    gl_PointSize = splat;
    arrived = vec4(photon.w / (splat * splat), 0.0, 0.0, 1.0);
#endif
}
