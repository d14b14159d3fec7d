// kd-ropes: Popov, Günther, Seidel, Slusallek, "Stackless KD-Tree Traversal for High Performance GPU Ray
// Tracing", Eurographics 2007 (survey, section 3.4, Figures 15 to 17). A leaf holds its box and a rope for
// each face. By default (option `ropes`), a rope links to the smallest node behind the face that covers the
// whole face. A ray leaves through the face that it meets first, and descends from the rope's node.
//
// Departures: the paper compares the point of entry with the planes of the tree. Here the t of the entry is
// compared with the t of the planes. The same expression computes both t, so a ray that enters on a plane
// has exactly the plane's t. Such a ray goes to the side to which its direction points. A ray through an
// edge or a corner of a leaf crosses one face after the other. Its t never decreases, so no two leaves send
// the ray back and forth.

#include "methods/kdtree/kd_common.glsl"
#include "methods/kdtree/ropes.glsl"

void start_search(inout State state) {
}

void take_only_child(inout State state) {
}

void pass_far_child(pointer far, float t_max, inout State state) {
}

void leave_leaf(inout State state, Hit hit) {
    state.phase = FOLLOW_ROPE;
}

void follow_rope(Ray ray, inout State state, inout Hit hit) {
    pointer leaf = pointer_to(kd_node_axis(state.node) - LEAF);
    vec3 exits = planes_t(ray, faces_ahead(leaf, goes_down(ray)));
    float t_leave = min_component(exits);
    pointer rope = rope_taken(exits, t_leave, ropes_ahead(leaf, goes_down(ray)));
    bool outside = is_null(rope);
    state.phase = DOWN;
    if (hit.t < t_leave || t_leave >= state.t_exit || outside) {
        state.phase = DONE;
    }
    state.node = outside ? FIRST : rope;
    state.t_min = max(state.t_min, resumed(t_leave));
    state.t_max = state.t_exit;
}
