#version 330 core
// Adds one visit to the count of a node, by blending.

#include <records>

void main() {
    visits_store(Visits(1));
}
