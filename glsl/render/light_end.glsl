// Where a shadow ray ends, so that it does not meet what it goes to.

// It ends before the light by as much as its end is off: five roundings for the distance, one for the
// direction, and six with which a surface there is seen (its vertices' and the shear's); then
// direction and end are stored.
const float LIGHT_ERROR = 12.0 * ARITHMETIC_UNIT + 4.0 * STORAGE_UNIT;

// A place on a triangle is known to some units of the largest coordinates, and seen with as many of
// its extent, along the normal.
float place_error(vec3 place, vec3 edge_u, vec3 edge_v) {
    vec3 off = abs(place) + abs(edge_u) + abs(edge_v);
    return LIGHT_ERROR * max(max(off.x, off.y), off.z);
}

// The end, in units of a direction of length 1, of a ray that meets the triangle at this cosine.
float shadow_end(float distance, float error, float facing) {
    return distance * (1.0 - LIGHT_ERROR) - min(error / max(facing, 1e-4), 0.5 * distance);
}
