#version 330 core
// Write the points that the light would see if the scene had no refractor. Photons look up receivers in
// this image (caustic_splat.vert).

in vec3 place;

out vec4 receiver;    // position; w is 1 where a receiver exists, else 0

void main() {
    receiver = vec4(place, 1.0);
}
