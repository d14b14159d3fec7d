#version 330 core
// A level of the min and max pyramids of a geometry image (Carr et al. 2006; see
// glsl/methods/geometry_image/geometry_image.glsl): a fragment is a node, whose box is that of its up to four
// children on the level below, or with CELLS, on the finest level, of the four texels of its cell. The
// far row and column belong to the cells on either side of them. With COPY the box is taken as it is.
// Only the boxes are written: colour masks keep the links beside them.

#include "core/fetch.glsl"
#include <tables>

layout(location = 0) out vec4 lower;
layout(location = 1) out vec4 upper;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int i = (texel.y << TABLE_WIDTH_LOG2) + texel.x;
#ifdef COPY
    vec3 lo = min_pyramid_lo(i);
    vec3 hi = max_pyramid_hi(i);
#else
    int first = pyramid_source_first(i);
    int last = pyramid_source_last(i);
#ifdef CELLS
    vec3 a = position_at(first);
    vec3 b = position_at(first + 1);
    vec3 c = position_at(last - 1);
    vec3 d = position_at(last);
    vec3 lo = min(min(a, b), min(c, d));
    vec3 hi = max(max(a, b), max(c, d));
#else
    vec3 lo = min_pyramid_lo(first);
    vec3 hi = max_pyramid_hi(first);
    for (int child = 1; child < 4; ++child) {
        int j = min(first + child, last);
        lo = min(lo, min_pyramid_lo(j));
        hi = max(hi, max_pyramid_hi(j));
    }
#endif
#endif
    lower = vec4(lo, 0.0);
    upper = vec4(hi, 0.0);
}
