#version 330 core
// The work of one element of a stream.

#include <records>

flat in vec3 did;

void main() {
    tally_store(Tally(int(did.x), int(did.y), int(did.z)));
}
