#version 330 core
// Adds a node's visits to the visits of its fan.x * fan.y children, by blending.

#include <records>

uniform ivec2 fan;

void main() {
    visits_store(Visits(above_load(ivec2(gl_FragCoord.xy) / fan).count));
}
