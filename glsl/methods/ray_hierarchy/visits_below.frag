#version 330 core
// Adds the number of visits of a node to the visits of its children, by blending.

#include <records>

uniform ivec2 fan;

void main() {
    visits_store(Visits(above_load(ivec2(gl_FragCoord.xy) / fan).count));
}
