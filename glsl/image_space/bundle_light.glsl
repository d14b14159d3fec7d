// Radiance between neighbouring layers of a bundle (parallel rays). The sky lies beyond all layers.

uniform vec3 sky_before;    // radiance of the sky before the first layer
uniform vec3 sky_behind;    // radiance of the sky behind the last layer
uniform float weight;       // solid angle that the bundle stands for, in each of its two directions

// Radiance that leaves a layer towards the viewer. `side` is the triangle's side that faces the viewer, or
// -1 for the sky behind the last layer.
vec3 seen_from_before(int side) {
    return side < 0 ? sky_behind : leaving_radiance(side);
}

// Radiance that leaves a layer away from the viewer, from the side opposite to `side`. If `side` is -1, the
// radiance of the sky before the first layer.
vec3 seen_from_behind(int side) {
    return side < 0 ? sky_before : leaving_radiance(side ^ 1);
}
