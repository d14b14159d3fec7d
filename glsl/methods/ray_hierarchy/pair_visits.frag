#version 330 core
// Adds one visit to a node.

#include <records>

void main() {
    visits_store(Visits(1));
}
