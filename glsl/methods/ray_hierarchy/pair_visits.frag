#version 330 core
// One more visit of a node.

#include <records>

void main() {
    visits_store(Visits(1));
}
