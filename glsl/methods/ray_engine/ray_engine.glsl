// The Ray Engine: Carr, Hall, Hart, "The Ray Engine", Graphics Hardware 2002 (survey, section 3.1, Figures
// 4 and 5). The host walks rays through a grid, or an octree if the option `cells` says so. The host
// puts the rays in each cell into a queue. Textures hold one batch of rays at a time. Each triangle of the
// queue's cell is drawn as a quad over the rays of the queue, so the rasteriser generates one fragment for
// each pair of ray and triangle.
//
// Departures: the tests of core/triangle.glsl decide pairs in float32. The paper's Radeon 8500 (R200) used
// fixed point, which the option `fixed_point` reconstructs (fixed_point.glsl). MIN blending on a float
// target keeps the nearest t, and a second pass with MIN blending keeps the lowest index among the
// triangles at this t. The paper uses the depth buffer, whose 24 bits distinguish too few distances; the
// option `nearest` can select it. Triangles stay on the GPU, and a quad holds only the row of its triangle.

// The triangle of the quad, equal at all corners of the quad.
flat in int quad_triangle;
flat in vec3 quad_v0;
flat in vec3 quad_v1;
flat in vec3 quad_v2;

// core/triangle.glsl calls these accessors. Instead of the triangle table they read the quad's triangle.
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
