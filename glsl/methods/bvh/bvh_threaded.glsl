// bvh-threaded: Thrane and Simonsen, "A Comparison of Acceleration Structures for GPU Assisted Ray
// Tracing", master's thesis, Aarhus 2005 (survey, section 3.5, Figure 19). Nodes lie in depth-first order.
// A ray that enters an inner node goes on to the next node. A ray that misses a node, or has tested the
// triangles of a leaf, goes to the escape index: the node after the subtree. So a ray needs no stack.
//
// Departures: a leaf holds several triangles; a leaf of the thesis holds one. With OCTANTS, the tree is
// stored eight times, once for each direction octant. The child that is nearer to rays of the octant comes
// first; the thesis has one order for all rays. With `shared_subtrees`, the copies share the lower part of
// the tree (methods/bvh/shared_subtrees.glsl, the file <subtrees>). With `entry_points`, a ray walks only
// through the subtrees in its tile's list (methods/bvh/threaded_entries.glsl, the file <entries>).

#include "core/quantised.glsl"
#include "methods/bvh/bvh_nodes.glsl"
#include "core/octant.glsl"

uniform pointer node_count;

pointer root_for(Ray ray) {
    pointer root = FIRST;
#ifdef OCTANTS
    root = multiplied(node_count, direction_octant(ray.direction));
#endif
    return root;
}

// Visit node i: descend into the node, go to the triangles of a leaf, or follow the escape index. Return
// the escape index.
pointer visit(Ray ray, pointer i, Hit hit, inout State state) {
    COUNT(nodes_visited);
    vec3 lo = bvh_node_lo(i);
    vec3 hi = bvh_node_hi(i);
    order_corners(lessThan(ray.direction, vec3(0.0)), lo, hi);
    vec2 interval = box_interval(ray, lo, hi);
    bool entered = larger(interval.x, ray.t_min) <= smaller(interval.y, hit.t);
    pointer first = bvh_node_first(i);
    pointer escape = bvh_node_escape(i);
    bool inner = is_null(first);
    pointer past = behind(escape, AFTER(state));
    state.node = entered && inner ? below(i, first) : past;
    AFTER(state) = way_out(first, escape, past, entered && inner, AFTER(state));
    if (entered && !inner) {
        COUNT(leaves_visited);
        state.cursor = first;
        state.phase = INTERSECT;
    }
    return escape;
}

#include <entries>

void init(Ray ray, out State state) {
    AFTER(state) = NOWHERE;
    state.cursor = FIRST;
    begin(ray, state);
}

void traverse(Ray ray, inout State state, inout Hit hit) {
    visit(ray, state.node, hit, state);
    if (state.phase == TRAVERSE && subtree_ends(state)) {
        state.phase = LEAVE;
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    pointer i = state.cursor;
    test_triangle(ray, i, hit);
    state.cursor = moved(i, 1);
    if (triangle_last(i) != 0) {
        state.phase = subtree_ends(state) ? LEAVE : TRAVERSE;
    }
    if (search_over(hit)) {
        state.phase = DONE;
    }
}
