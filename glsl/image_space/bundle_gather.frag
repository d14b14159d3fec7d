#version 330 core
// Final gathering by parallel projection (Hachisuka, GPU Gems 2, chapter 38, 2005; survey, section 5; fact
// sheet G2): a place that is to be lit looks where it lies in the projection. If it is between these two
// neighbouring layers, then what lies along the bundle is the one that it faces, and its light is added,
// by the cosine. One peeling serves both ways along the direction.
//
// Departures: a layer's depth is that of its triangle's plane at the very place, not at the pixel's
// centre, so that the place's own surface needs no bias that grows with its slope, only a part of a
// pixel for surfaces that bend away from their neighbour's plane; and places that face either way share a
// peeling, where the chapter looks along one.

#include <constants>
#include "core/fetch.glsl"
#include <tables>
#include <streams>
#include "image_space/parallel.glsl"
#include "image_space/bundle_light.glsl"

uniform sampler2D places;
uniform sampler2D normals;
uniform float lift;      // world units: how far off its surface a place stands

out vec4 sum;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec3 normal = texelFetch(normals, texel, 0).xyz;
    vec3 at = projected(texelFetch(places, texel, 0).xyz + lift * normal);
    ivec2 pixel = ivec2(floor(at.xy));
    vec2 off = at.xy - vec2(pixel) - 0.5;
    Nearer before = nearer_load(pixel);
    Layer behind = layer_load(pixel);
    float nearer_depth = before.depth + dot(before.slope, off);
    float layer_depth = behind.depth + dot(behind.slope, off);
    float facing = -dot(normal, along);
    bool lit = facing > 0.0 ? nearer_depth < at.z && layer_depth >= at.z
                            : layer_depth > at.z && nearer_depth <= at.z;
    if (lit && facing != 0.0) {
        vec3 radiance = facing > 0.0 ? seen_from_behind(before.side) : seen_from_before(behind.side);
        sum = vec4(radiance, 1.0) * abs(facing) * weight;
    } else {
        discard;
    }
}
