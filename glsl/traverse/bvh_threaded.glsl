// Threaded BVH: Thrane and Simonsen, "A Comparison of Acceleration Structures for GPU Assisted Ray
// Tracing", master's thesis, Aarhus 2005 (survey, section 3.5, Figure 19). Nodes lie in depth-first
// order; a ray that enters an inner node goes on to the next one, any other follows the escape
// index, so no stack is needed.
//
// Departures: leaves hold a run of triangles instead of one. With OCTANTS the tree is stored eight
// times, threaded so that the child nearer to rays of a direction octant comes first; the thesis
// has one order for all rays.

#include "common/quantised.glsl"
#include "common/bvh_nodes.glsl"

uniform int node_count;

void init(Ray ray, out State state) {
    state.node = 0;
#ifdef OCTANTS
    ivec3 negative = ivec3(lessThan(ray.direction, vec3(0.0)));
    state.node = node_count * (negative.x + 2 * negative.y + 4 * negative.z);
#endif
    state.cursor = 0;
    state.phase = node_count > 0 ? TRAVERSE : DONE;
}

void traverse(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    int i = state.node;
    vec2 interval = box_interval(ray, bvh_node_lo(i), bvh_node_hi(i));
    bool entered = max(interval.x, ray.t_min) <= min(interval.y, hit.t);
    int first = bvh_node_first(i);
    bool inner = first < 0;
    state.node = entered && inner ? i + 1 : bvh_node_escape(i);
    if (entered && !inner) {
        COUNT(leaves_visited);
        state.cursor = first;
        state.phase = INTERSECT;
    } else if (state.node < 0) {
        state.phase = DONE;
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    int i = state.cursor;
    test_triangle(ray, i, hit);
    ++state.cursor;
    if (triangle_last(i) != 0) {
        state.phase = state.node < 0 ? DONE : TRAVERSE;
    }
    if (search_over(hit)) {
        state.phase = DONE;
    }
}
