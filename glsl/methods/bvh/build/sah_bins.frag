#version 330 core
// Computes the bins of the triangle in each slot (position in the order of the triangles), along the three
// axes. The bins of a node have equal widths and cover the range of its triangles' box centres. Channel w
// holds the node's rank among the large nodes (large.glsl), or -1 if the node is not large.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/middle.glsl"
#include "methods/bvh/build/sah.glsl"
#include "methods/bvh/build/large.glsl"

void main() {
    Slot slot = slot_load(table_texel(element()));
    int node = max(slot.node, 0);
    int rank = int(large_load(table_texel(node)).value.x);
    bool binned = slot.node >= 0 && is_large(interval_load(table_texel(node)));
    Range range = range_load(table_texel(rank));
    vec3 extent = -range.hi - range.lo;
    vec3 per_unit = float(BINS) / extent;
    vec3 place = (middle_of(box_load(table_texel(slot.triangle))) - range.lo) * per_unit;
    vec3 bins = clamp(floor(place), 0.0, float(BINS - 1));
    // Use one bin along an axis whose extent is zero, or so small that the inverse overflows.
    bins = vec3(per_unit.x < FAR ? bins.x : 0.0, per_unit.y < FAR ? bins.y : 0.0,
                per_unit.z < FAR ? bins.z : 0.0);
    values_store(Values(vec4(bins, binned ? float(rank) : -1.0)));
}
