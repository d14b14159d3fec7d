#version 330 core
// What was counted at a node is handed down to its children, where blending adds it.

#include <records>

uniform ivec2 fan;

void main() {
    visits_store(Visits(above_load(ivec2(gl_FragCoord.xy) / fan).count));
}
