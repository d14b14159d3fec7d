#version 330 core
// Tests each eye ray against its candidate, the triangle that the rasteriser shows at the ray's pixel. The
// test is the triangle test of all methods. Writes the hit's triangle, and a depth that equals the hit's
// depth or is slightly larger (infinite without a hit). A ray that misses its candidate is in doubt: the
// tracer's method traces it later. A depth of -1 makes the other passes skip this ray.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"
#include "stages/cover.glsl"

uniform sampler2D candidates;

layout(location = IN_DOUBT) out float in_doubt;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
    int row = int(texelFetch(candidates, pixel, 0).x);
    test_triangle(ray, max(row, 0), hit);
    bool failed = row >= 0 && !hit_found(hit);
    if (row < 0) {
        hit = no_hit(ray.t_max);
    }
    hit_store(hit);
    in_doubt = failed ? 1.0 : 0.0;
#ifdef PROVED
    float depth = hit.t / slant(gl_FragCoord.xy) * (1.0 + 4.0 * ERROR);
    shown_store(Shown(failed ? -1.0 : depth, hit.triangle));
#endif
}
