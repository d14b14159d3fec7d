#version 330 core
// What an element of a stream did.

#include <records>

flat in vec3 did;

void main() {
    tally_store(Tally(int(did.x), int(did.y), int(did.z)));
}
