#version 330 core
// Computes a level of a ray hierarchy from the level below: up to four nodes become one node.

#include "core/precision.glsl"
#include <streams>
#include "methods/ray_hierarchy/ray_hierarchy.glsl"

uniform ivec2 fan;     // fan.x * fan.y = 4 nodes of the level below become one node
uniform ivec2 below;   // number of nodes of the level below, along x and y

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Cone children[4];
    for (int k = 0; k < 4; ++k) {
        ivec2 node = fan * pixel + ivec2(k % fan.x, k / fan.x);
        children[k] = no_cone();
        if (all(lessThan(node, below))) {
            children[k] = cone_load(node);
        }
    }
    cone_store(cone_over(children));
}
