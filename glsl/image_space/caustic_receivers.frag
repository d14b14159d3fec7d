#version 330 core
// Places that the light sees without the refractor: what caustics mapping looks receivers up in (see
// caustic_splat.vert).

in vec3 place;

out vec4 receiver;    // and 1 where there is one

void main() {
    receiver = vec4(place, 1.0);
}
