#version 330 core
// Writes the work of one element of a stream (see stream_tally.vert).

#include <records>

flat in vec3 did;

void main() {
    tally_store(Tally(int(did.x), int(did.y), int(did.z)));
}
