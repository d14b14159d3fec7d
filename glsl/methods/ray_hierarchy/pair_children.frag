#version 330 core
// Traverses one level of a ray hierarchy. Tests the triangle of a (triangle, node) pair against the node's
// four children, and writes four new pairs to four render targets. A new pair is empty if no ray of the
// child can hit the triangle.

#include "core/precision.glsl"
#include <records>
#include "core/stream.glsl"
#include "methods/ray_hierarchy/ray_hierarchy.glsl"

uniform int base;      // the first pair of this pass
uniform ivec2 fan;     // a node has fan.x * fan.y = 4 children
uniform ivec2 below;   // number of nodes of the children's level, along x and y

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
