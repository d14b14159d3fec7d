#version 330 core
// Writes the work of a stream element: its visits of nodes and leaves, and its triangle tests.

#include <records>

flat in vec3 did;

void main() {
    tally_store(Tally(int(did.x), int(did.y), int(did.z)));
}
