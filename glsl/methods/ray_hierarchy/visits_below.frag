#version 330 core
// Passes the number of visits of a node down to its children, where blending adds it to their own visits.

#include <records>

uniform ivec2 fan;

void main() {
    visits_store(Visits(above_load(ivec2(gl_FragCoord.xy) / fan).count));
}
