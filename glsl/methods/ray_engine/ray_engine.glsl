// The Ray Engine: Carr, Hall, Hart, "The Ray Engine", Graphics Hardware 2002 (survey, section 3.1,
// Figures 4 and 5). The host walks rays through a grid and queues them by cell. A batch of rays
// lies in a texture, and each triangle is drawn as a quad over the rays of the queues whose cell
// lists it: the rasteriser multiplies rays by triangles, a fragment is a pair.
//
// Departures: pairs are decided by the tests of core/triangle.glsl in float32, not in the fixed
// point of R200. The nearest hit is kept by MIN blending on a float target, and of the triangles
// there the lowest index by MIN again (24 bits of depth tell too few distances apart: the option
// `nearest` has them). Triangles stay on the GPU, a quad only brings the row of its triangle.

// A triangle as the quad carries it, the same at each of its corners.
flat in int quad_triangle;
flat in vec3 quad_v0;
flat in vec3 quad_v1;
flat in vec3 quad_v2;

// What core/triangle.glsl asks for: here every triangle that it can ask for is the quad's.
vec3 triangle_v0(int i) {
    return quad_v0;
}

vec3 triangle_v1(int i) {
    return quad_v1;
}

vec3 triangle_v2(int i) {
    return quad_v2;
}

int triangle_index(int i) {
    return quad_triangle;
}
