// Quantised bounds of nodes: whole numbers of steps from the lower corner of the scene's box. The builder
// decodes by the same expression. If a decoded bound would lie inside the exact box, the builder moves the
// bound outward by one step.

#ifdef QUANTISED_NODES

uniform vec3 quantum;

// Read `quantum` once, because llvmpipe fetches a uniform lane by lane at each use. The compiler would
// replace a plain copy by the uniform, so store the result of an operation (max).
vec3 bound_step = max(quantum, vec3(0.0));

vec3 decoded(uint x, uint y, uint z) {
    return R(scene_lo + R(vec3(uvec3(x, y, z)) * bound_step));
}

#endif
