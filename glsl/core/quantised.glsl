// Bounds in steps of the scene's box, rounded outward by the builder against the very expression here,
// so that every box holds what it held.

#ifdef QUANTISED_NODES

uniform vec3 quantum;

// Read once: llvmpipe fetches a uniform lane by lane wherever it is named, also in a loop. A mere copy
// would be named again there; a result is kept.
vec3 bound_step = max(quantum, vec3(0.0));

vec3 decoded(uint x, uint y, uint z) {
    return R(scene_lo + R(vec3(uvec3(x, y, z)) * bound_step));
}

#endif
