#version 330 core
// Computes the boxes of a level of the min and max pyramids of a geometry image (Carr et al. 2006; see
// methods/geometry_image/geometry_image.glsl). Each box bounds at most four children on the level below.
// With CELLS, on the finest level, the box bounds the four texels of the node's cell; adjacent cells share
// a row or column of texels. With COPY, boxes are copied unchanged. Colour masks protect the fourth
// channels, which hold the links.

#include "core/fetch.glsl"
#include <tables>

layout(location = 0) out vec4 lower;
layout(location = 1) out vec4 upper;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int i = (texel.y << TABLE_WIDTH_LOG2) + texel.x;
#if defined(COPY)
    vec3 lo = min_pyramid_lo(i);
    vec3 hi = max_pyramid_hi(i);
#elif defined(CELLS)
    int first = pyramid_source_first(i);
    int last = pyramid_source_last(i);
    vec3 a = position_at(first);
    vec3 b = position_at(first + 1);
    vec3 c = position_at(last - 1);
    vec3 d = position_at(last);
    vec3 lo = min(min(a, b), min(c, d));
    vec3 hi = max(max(a, b), max(c, d));
#else
    int first = pyramid_source_first(i);
    int last = pyramid_source_last(i);
    vec3 lo = min_pyramid_lo(first);
    vec3 hi = max_pyramid_hi(first);
    for (int child = 1; child < 4; ++child) {
        int j = min(first + child, last);
        lo = min(lo, min_pyramid_lo(j));
        hi = max(hi, max_pyramid_hi(j));
    }
#endif
    lower = vec4(lo, 0.0);
    upper = vec4(hi, 0.0);
}
