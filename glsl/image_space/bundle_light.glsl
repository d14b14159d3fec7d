// Radiance that neighbouring layers of a bundle send each other. The sky lies beyond the first and last
// layer.

uniform vec3 sky_before;    // sky radiance along the bundle, and against it
uniform vec3 sky_behind;
uniform float weight;       // solid angle of the bundle, for either way

// Radiance that leaves the side of a triangle which faces the viewer, or faces away.
vec3 seen_from_before(int side) {
    return side < 0 ? sky_behind : leaving_radiance(side);
}

vec3 seen_from_behind(int side) {
    return side < 0 ? sky_before : leaving_radiance(side ^ 1);
}
