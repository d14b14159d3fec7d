#version 330 core
// A level of the traversal of a ray hierarchy: the triangle of a pair is tested against the node's four
// children. The results go to four targets. A result is empty if no ray of the child may hit the triangle.

#include "core/precision.glsl"
#include <records>
#include "core/stream.glsl"
#include "methods/ray_hierarchy/ray_hierarchy.glsl"

uniform int base;      // the first pair of this pass
uniform ivec2 fan;     // children of a node, by axis; four in all
uniform ivec2 below;   // nodes of the children's level, by axis

ivec3 child(Pair pair, vec4 ball, int k) {
    ivec2 node = fan * ivec2(pair.x, pair.y) + ivec2(k % fan.x, k / fan.x);
    bool there = all(lessThan(node, below));
    bool kept = there && may_hit(ball, cone_load(min(node, below - 1)));
    return kept ? ivec3(pair.triangle, node) : ivec3(-1);
}

void main() {
    Pair pair = pair_load(table_texel(base + element()));
    vec4 ball = ball_load(table_texel(pair.triangle)).value;
    children_store(Children(child(pair, ball, 0), child(pair, ball, 1), child(pair, ball, 2),
                            child(pair, ball, 3)));
}
