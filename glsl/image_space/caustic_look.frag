#version 330 core
// Look up the caustic map like a shadow map (Shah, Konttinen and Pattanaik 2007; see caustic_splat.vert). A
// point that the light sees has a texel in the light's image. The point's irradiance is the flux of this
// texel, divided by the area that the texel covers on the surface.

#include "stages/cover.glsl"

uniform sampler2D places;
uniform sampler2D normals;      // unit normals on the lit side, or zeros
uniform sampler2D receivers;
uniform sampler2D caustic;      // flux of each texel

out float irradiance;

void main() {
    irradiance = 0.0;
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec3 place = texelFetch(places, texel, 0).xyz;
    vec3 normal = texelFetch(normals, texel, 0).xyz;
    vec4 clip = clip_place(place);
    vec2 at = (clip.xy / clip.w * 0.5 + 0.5) * size;
    if (clip.w < nearest || min(at.x, at.y) < 0.0 || at.x >= size.x || at.y >= size.y) {
        return;
    }
    vec4 there = texelFetch(receivers, ivec2(at), 0);
    float away = distance(place, eye);
    float cosine = dot(normal, eye - place) / away;
    float across = 2.0 * length(right) / size.x * away;    // a texel's width at this distance
    // Skip the point if the light sees another surface in this texel.
    if (there.w > 0.0 && cosine > 0.0 && abs(dot(there.xyz - place, normal)) < across) {
        float slanted = slant(floor(at) + 0.5);
        float solid = 4.0 * length(right) * length(up)
            / (size.x * size.y * slanted * slanted * slanted);
        irradiance = texelFetch(caustic, ivec2(at), 0).x * cosine / (solid * away * away);
    }
}
