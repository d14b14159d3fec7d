#version 330 core
// Filters a ray stream: each ray tests the boxes of its node's two children. The ray's next node is the
// nearer child that the ray meets, or the current node if this node is a leaf. Each ray writes four flags:
// the next node is an inner node; the ray also meets the farther child; the next node is a leaf; the ray
// has tested two boxes.

#include "core/precision.glsl"
#include "core/stream.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/box.glsl"
#include "methods/bvh/ray_stream.glsl"

uniform int base;      // the first element of this pass
uniform int step_cap;

bool within_cap(ivec2 pixel) {
#ifdef TALLIED
    Tally tally = tally_load(pixel);
    return tally.nodes_visited + tally.triangles_tested < step_cap;
#else
    return true;
#endif
}

void main() {
    Queued at = queued_load(table_texel(base + element()));
    ivec2 pixel = ivec2(at.x, at.y);
    Hit hit = hit_load(pixel);
    bool live = at.t_enter <= hit.t && !search_over(hit) && within_cap(pixel);
    bool inner = live && !is_leaf(at.child);
    Visited found = Visited(live ? at.child : NOTHING, at.t_enter, NOTHING, 0.0, 0, 0);
    if (inner) {
        found = visit(ray_setup(rays_load(pixel)), hit.t, at.child);
    }
    found.x = at.x;
    found.y = at.y;
    visited_store(found);
    bool near = found.near != NOTHING, leaf = near && is_leaf(found.near);
    values_store(Values(vec4(near && !leaf, found.far != NOTHING, leaf, inner)));
}
