#version 330 core
// Tests an eye ray against a rival: a triangle that comes before the shown hit of a nearby pixel. If the
// rival also comes before the ray's own hit, the ray is in doubt: the rasteriser shows a wrong hit, and the
// ray must be traced.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"

flat in int rival;

out float in_doubt;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Hit shown = hit_load(pixel);
    Hit hit = shown;
    test_triangle(ray_setup(rays_load(pixel)), rival, hit);
    if (hit.triangle == shown.triangle) {
        discard;
    }
    in_doubt = 1.0;
}
