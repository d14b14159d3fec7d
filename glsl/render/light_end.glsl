// Computes the end of a shadow ray. The ray must not hit the light at which it aims.

// The relative error of a shadow ray's end. The distance is computed with five roundings, and the direction
// with one. The triangle test adds six roundings, of the triangle's vertices and of the shear. Storing the
// direction and the end rounds again.
const float LIGHT_ERROR = 12.0 * ARITHMETIC_UNIT + 4.0 * STORAGE_UNIT;

// A bound on the error of a point on a triangle, measured along the normal. The error of the point grows
// with the point's coordinates. The error of the triangle test grows with the triangle's edges.
float place_error(vec3 place, vec3 edge_u, vec3 edge_v) {
    vec3 off = abs(place) + abs(edge_u) + abs(edge_v);
    return LIGHT_ERROR * max(max(off.x, off.y), off.z);
}

// The end of a shadow ray with a unit direction. `error` bounds the error of the light's point along the
// light's normal. `facing` is the cosine between the ray and this normal.
float shadow_end(float distance, float error, float facing) {
    return distance * (1.0 - LIGHT_ERROR) - min(error / max(facing, 1e-4), 0.5 * distance);
}
