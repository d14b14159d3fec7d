// The end of a shadow ray, which must not hit the light that the ray aims at.

// Relative error of the end: five roundings for the distance, one for the direction, and six for the test
// of a surface there (its vertices and the shear); then the direction and the end are stored. The ray ends
// this much before the light.
const float LIGHT_ERROR = 12.0 * ARITHMETIC_UNIT + 4.0 * STORAGE_UNIT;

// The error of a point on a triangle along the normal: a few units of the largest coordinate for the point,
// and as many units of the triangle's extent for the triangle test.
float place_error(vec3 place, vec3 edge_u, vec3 edge_v) {
    vec3 off = abs(place) + abs(edge_u) + abs(edge_v);
    return LIGHT_ERROR * max(max(off.x, off.y), off.z);
}

// The end of a ray with a unit direction that meets the triangle at the cosine `facing`.
float shadow_end(float distance, float error, float facing) {
    return distance * (1.0 - LIGHT_ERROR) - min(error / max(facing, 1e-4), 0.5 * distance);
}
