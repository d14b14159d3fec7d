#version 330 core
// A photon of a caustic, a vertex each, looks for the receiver in the light's own image and lands there
// as a point (Shah, Konttinen and Pattanaik 2007; survey, section 5): it guesses a distance d, looks
// which receiver the light sees behind V + d T, takes the distance of that one from V for the next
// guess, and so on. The points' blending adds their light up: the caustic map.
//
// Departures: the first guess is d = 0 instead of one unit, so that scale does not matter; and a photon
// whose way to the refractor something stands in, or that leaves the light's image, is dropped.
// KNOWN: places where photons land are given, by rays that were traced, say. HOME: each photon goes to
// its own texel, with where it landed, to be read back.

#include <constants>
#include "stages/cover.glsl"

uniform int photons;      // a side of their image
#ifdef KNOWN
uniform sampler2D landed;
#else
uniform sampler2D leaving;
uniform sampler2D start;
uniform sampler2D receivers;
uniform int iterations;
#endif
#ifndef HOME
uniform float splat;      // pixels a side of a point
#endif

flat out vec4 arrived;

// The texel of the light's image where it sees a place.
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

// Where a photon comes to, and its light: none where it is lost.
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
