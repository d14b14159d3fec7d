// Bounds in steps of the scene's box. The builder rounds them outward by the same expression as here, so
// that a quantised box contains the exact box.

#ifdef QUANTISED_NODES

uniform vec3 quantum;

// Read `quantum` once: llvmpipe fetches a uniform lane by lane at each use, also in a loop. The compiler
// would replace a plain copy by the uniform, so store the result of an operation.
vec3 bound_step = max(quantum, vec3(0.0));

vec3 decoded(uint x, uint y, uint z) {
    return R(scene_lo + R(vec3(uvec3(x, y, z)) * bound_step));
}

#endif
