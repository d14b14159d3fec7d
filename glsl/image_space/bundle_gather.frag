#version 330 core
// Final gathering by parallel projection (Hachisuka, GPU Gems 2, chapter 38, 2005; survey, section 5). A
// receiving point between two neighbouring layers of the bundle sees the layer that it faces. It receives
// this layer's light times the cosine between its normal and the bundle.
//
// Departures: a layer's depth is the depth of its triangle's plane at the point itself, not at the pixel's
// centre. So a sloped surface does not hide itself. Points are still lifted along the normal by a fraction
// of a pixel, because a curved surface bends away from the plane of a neighbouring triangle. One peeling
// serves points that face along or against the bundle. The chapter's peeling serves one direction.

#include <constants>
#include "core/fetch.glsl"
#include <tables>
#include <streams>
#include "image_space/parallel.glsl"
#include "image_space/bundle_light.glsl"

uniform sampler2D places;
uniform sampler2D normals;
uniform float lift;      // distance of a point from its surface, world units

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
