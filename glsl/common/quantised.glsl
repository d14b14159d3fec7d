// Bounds in steps of the scene's box, rounded outward by the builder against the very expression here,
// so that every box holds what it held.

#ifdef QUANTISED_NODES

uniform vec3 quantum;

vec3 decoded(uint x, uint y, uint z) {
    return R(scene_lo + R(vec3(uvec3(x, y, z)) * quantum));
}

#endif
