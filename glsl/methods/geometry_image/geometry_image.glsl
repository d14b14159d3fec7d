// Geometry images: Carr, Hoberock, Crane and Hart, "Fast GPU Ray Tracing of Dynamic Meshes using Geometry
// Images", Graphics Interface 2006 (survey, section 3.5, Figure 21). The mesh is an image of positions;
// four adjacent texels (2 x 2) form a quad of two triangles. A min and a max pyramid hold the boxes of
// coarser and coarser quads. Passes compute the boxes anew whenever positions change (pyramid.frag). The
// order of the nodes never changes. Links in the fourth channels of the pyramids store the order. The hit
// link leads to the first child. The miss link leads to the next sibling of the node or of the nearest
// ancestor that has a next sibling.
//
// Departures: an image need not be square or a power of two; nodes outside the image do not exist. Several
// charts form a forest in one pair of textures: the miss link of each root leads to the next root. So one
// pass traces all charts; a pass of the paper traces one image. The option `level` stops a ray at the quads
// of a coarser level. The triangles of a mesh that is not an image are laid out along a Morton curve, one
// per cell. With FRONT_TO_BACK, the links, but not the boxes, are stored eight times, once for each
// direction octant, so that the nearer child comes first.

#include "core/octant.glsl"

uniform int roots[8];   // the root for each direction octant; -1 if the image is empty

#ifdef FRONT_TO_BACK
uniform int node_count;

int miss_link(Ray ray, int i) {
    return pyramid_link_miss(node_count * direction_octant(ray.direction) + i);
}

int hit_link(Ray ray, int i) {
    return pyramid_link_hit(node_count * direction_octant(ray.direction) + i);
}
#else
int miss_link(Ray ray, int i) {
    return min_pyramid_miss(i);
}

int hit_link(Ray ray, int i) {
    return max_pyramid_hit(i);
}
#endif

void init(Ray ray, out State state) {
    state.node = roots[direction_octant(ray.direction)];
    state.cursor = 0;
    state.phase = state.node >= 0 ? TRAVERSE : DONE;
}

void traverse(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    int i = state.node;
    vec2 interval = box_interval(ray, min_pyramid_lo(i), max_pyramid_hi(i));
    bool entered = max(interval.x, ray.t_min) <= min(interval.y, hit.t);
    int below = hit_link(ray, i);
    state.node = entered && below >= 0 ? below : miss_link(ray, i);
    if (entered && below < 0) {
        COUNT(leaves_visited);
        state.cursor = -1 - below;
        state.phase = INTERSECT;
    } else if (state.node < 0) {
        state.phase = DONE;
    }
}

// A triangle without area shrinks to its first corner, as in the triangle table of all other methods.
void test_half(Ray ray, vec3 v0, vec3 v1, vec3 v2, bool flat_one, int face, inout Hit hit) {
    image_v0 = v0;
    image_v1 = flat_one ? v0 : v1;
    image_v2 = flat_one ? v0 : v2;
    image_face = face;
    test_triangle(ray, face, hit);
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    int i = state.cursor;
    int corner = image_cell_corner(i);
    int across = image_cell_across(i);
    int down = image_cell_down(i);
    int face = image_cell_face(i);
    int beside = corner + abs(across);
    vec3 a = position_at(corner);
    vec3 b = position_at(beside);
    vec3 c = position_at(beside + abs(down));
    test_half(ray, a, b, c, across < 0, face, hit);
#ifndef SINGLE_TRIANGLES
    vec3 d = position_at(corner + abs(down));
    test_half(ray, a, c, d, down < 0, face + 1, hit);
#endif
    state.phase = state.node < 0 || search_over(hit) ? DONE : TRAVERSE;
}
