// Threaded BVH: Thrane and Simonsen, "A Comparison of Acceleration Structures for GPU Assisted Ray
// Tracing", master's thesis, Aarhus 2005 (survey, section 3.5, Figure 19). Nodes lie in depth-first
// order; a ray that enters an inner node goes on to the next one, any other follows the escape
// index, so no stack is needed.
//
// Departures: leaves hold a run of triangles instead of one. With OCTANTS the tree is stored eight
// times, threaded so that the child nearer to rays of a direction octant comes first; the thesis
// has one order for all rays. With SHARED_SUBTREES what stands low in the tree is stored once
// (methods/bvh/shared_subtrees.glsl). With ENTRY_TILE (stages/entry_points.frag) a ray goes through the
// subtrees that its tile's list names: one ends where the escape index of its first node leads.

#include "core/quantised.glsl"
#include "methods/bvh/bvh_nodes.glsl"
#include "core/octant.glsl"

uniform int node_count;

int root_for(Ray ray) {
#ifdef OCTANTS
    return node_count * direction_octant(ray.direction);
#else
    return 0;
#endif
}

// Past a node: down into it, to the leaf's triangles, or along its escape index.
int visit(Ray ray, int i, Hit hit, inout State state) {
    COUNT(nodes_visited);
    vec3 lo = bvh_node_lo(i);
    vec3 hi = bvh_node_hi(i);
#ifdef SHARED_SUBTREES
    order_corners(lessThan(ray.direction, vec3(0.0)), lo, hi);
#endif
    vec2 interval = box_interval(ray, lo, hi);
    bool entered = larger(interval.x, ray.t_min) <= smaller(interval.y, hit.t);
    int first = bvh_node_first(i);
    int escape = bvh_node_escape(i);
    bool inner = first < 0;
#ifdef SHARED_SUBTREES
    int past = behind(escape, state.after);
    state.node = entered && inner ? below(i, first) : past;
    state.after = way_out(first, escape, past, entered && inner, state.after);
#else
    state.node = entered && inner ? i + 1 : escape;
#endif
    if (entered && !inner) {
        COUNT(leaves_visited);
        state.cursor = first;
        state.phase = INTERSECT;
    }
    return escape;
}

#ifdef ENTRY_TILE

#include "stages/entry_list.glsl"

void init(Ray ray, out State state) {
    state.node = state.end = -1;
#ifdef SHARED_SUBTREES
    state.after = -1;
#endif
    state.cursor = 0;
    state.entry = 0;
    state.phase = node_count > 0 ? ENTER : DONE;
}

bool subtree_ends(State state) {
    return state.node == state.end;
}

// The first node of the next subtree.
void enter(Ray ray, inout State state, inout Hit hit) {
    int code = entry_code(ivec2(gl_FragCoord.xy) / ENTRY_TILE, state.entry);
    if (code == LIST_END) {
        state.phase = DONE;
    } else {
        state.entry = is_rest(code) ? ENTRIES : state.entry + 1;
        int escape = visit(ray, entry_node(code, root_for(ray)), hit, state);
        state.end = is_rest(code) ? -1 : escape;
        if (state.phase == ENTER && !subtree_ends(state)) {
            state.phase = TRAVERSE;
        }
    }
}

#define LEAVE ENTER

#else

void init(Ray ray, out State state) {
    state.node = root_for(ray);
#ifdef SHARED_SUBTREES
    state.after = -1;
#endif
    state.cursor = 0;
    state.phase = node_count > 0 ? TRAVERSE : DONE;
}

bool subtree_ends(State state) {
    return state.node < 0;
}

#define LEAVE DONE

#endif

void traverse(Ray ray, inout State state, inout Hit hit) {
    visit(ray, state.node, hit, state);
    if (state.phase == TRAVERSE && subtree_ends(state)) {
        state.phase = LEAVE;
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    int i = state.cursor;
    test_triangle(ray, i, hit);
    ++state.cursor;
    if (triangle_last(i) != 0) {
        state.phase = subtree_ends(state) ? LEAVE : TRAVERSE;
    }
    if (search_over(hit)) {
        state.phase = DONE;
    }
}
