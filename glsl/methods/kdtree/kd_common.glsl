// What all kd-tree traversals share: a ray descends to the leaf at its t_min, tests the leaf's
// triangles one by one, and leaves it. Foley and Sugerman, "KD-Tree Acceleration Structures for a
// GPU Raytracer", Graphics Hardware 2005 (survey, section 3.4, Figures 10 to 12). What a method does
// about the child it passed by, and behind a leaf, stands in its own file.
//
// A plane at or before t_min sends the ray to the far child. t_split is computed by the same
// expression each time, so after a leaf's end became t_min the same plane compares as equal and
// the ray always moves on: no epsilon. (The survey's Figure 10 also takes the near child where
// t_split < 0, which is wrong for a ray that starts beyond the plane.)
//
// What others do instead stands behind the option `interval`, to be measured: `strict` leaves the
// plane at t_min to the near child (and comes to the same leaf for ever); the nudges push t_min on
// by a few ulp (rays still hang where the plane's t is off by more) or by 1e-6 (thin leaves are
// skipped).

#include "methods/kdtree/kd.glsl"

// What a method does at the start, on the way to a leaf, and behind it.
void start_search(inout State state);
void take_only_child(inout State state);
void pass_far_child(int far, float t_max, inout State state);
void leave_leaf(inout State state, Hit hit);

#ifdef ENTRY_TILE
#define BEGIN ENTER
#else
#define BEGIN DOWN
#endif

void init(Ray ray, out State state) {
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    state.node = 0;
    state.t_min = max(interval.x, ray.t_min);
    state.t_exit = min(max(box_exit(ray, scene_lo, scene_hi), state.t_min), ray.t_max);
    state.t_max = state.t_exit;
    state.cursor = 0;
    state.end = 0;
    state.phase = state.t_min <= min(interval.y, ray.t_max) ? BEGIN : DONE;
#ifdef ENTRY_TILE
    state.root = state.entry = 0;
#endif
    start_search(state);
}

// The root of the tree, or of the subtree that an entry list (stages/entry_points.frag) names.
int root_of(State state) {
#ifdef ENTRY_TILE
    return state.root;
#else
    return 0;
#endif
}

// Ends a search that is settled: a subtree's end is not yet the ray's.
void settle(inout State state, Hit hit) {
#ifdef ENTRY_TILE
    state.phase = hit.t < state.t_max ? DONE : ENTER;
#else
    state.phase = DONE;
#endif
}

#ifdef ENTRY_TILE

#include "stages/entry_list.glsl"

// The next subtree of the list that the ray goes through, and its interval there: between planes
// whose t are computed as splits' are, so that subtrees side by side share their ends.
void enter(Ray ray, inout State state, inout Hit hit) {
    int code = entry_code(ivec2(gl_FragCoord.xy) / ENTRY_TILE, state.entry);
    ++state.entry;
    if (code == LIST_END) {
        state.phase = DONE;
    } else {
        COUNT(nodes_visited);
        int node = entry_node(code, 0);
        vec3 lo = kd_bounds_lo(node);
        vec3 hi = kd_bounds_hi(node);
        float start = max(box_interval(ray, scene_lo, scene_hi).x, ray.t_min);
        float exit = min(max(box_exit(ray, scene_lo, scene_hi), start), ray.t_max);
        float t_first = max(start, box_entry(ray, lo, hi));
        float t_last = min(exit, max(box_exit(ray, lo, hi), start));
        if (t_first <= min(t_last, hit.t)) {
            state.node = state.root = node;
            state.t_min = t_first;
            state.t_max = state.t_exit = t_last;
            state.phase = DOWN;
            start_search(state);
        }
    }
}

#endif

// A hit before the leaf's end settles the ray, as does the end of its interval. (Without a hit,
// hit.t is the ray's own end.)
bool is_settled(State state, Hit hit) {
    return hit.t < state.t_max || state.t_max >= state.t_exit;
}

// The t that takes up a ray's interval behind a leaf that ends at t.
float resumed(float t) {
#if defined(INTERVAL_NUDGE_RELATIVE)
    return R(t + R(abs(t) * (4.0 * ARITHMETIC_UNIT)));
#elif defined(INTERVAL_NUDGE_ABSOLUTE)
    return R(t + 1e-6);
#else
    return t;
#endif
}

// From a node down again, with all that is left of the interval.
void search_rest(int node, inout State state) {
    state.t_min = resumed(state.t_max);
    state.t_max = state.t_exit;
    state.node = node;
    state.phase = DOWN;
}

void down(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    int node = state.node;
    int axis = kd_node_axis(node);
    int left = kd_node_left(node);
    if (axis >= LEAF) {
        COUNT(leaves_visited);
        state.cursor = left;
        state.end = left + kd_node_count(node);
        state.phase = INTERSECT;
        if (state.cursor == state.end) {
            leave_leaf(state, hit);
        }
    } else {
        float t_split = plane_t(ray, axis, kd_node_split(node));
        float d = along(axis, ray.inv_dir);
        int near = d < 0.0 ? left + 1 : left;
        int far = d < 0.0 ? left : left + 1;
#ifdef INTERVAL_STRICT
        bool takes_far = t_split < state.t_min;
#else
        bool takes_far = t_split <= state.t_min;
#endif
        state.node = takes_far ? far : near;
        if (takes_far || t_split >= state.t_max) {
            take_only_child(state);
        } else {
            float t_max = state.t_max;
            state.t_max = t_split;
            pass_far_child(far, t_max, state);
        }
    }
}

// One entry of the leaf's list. A hit beyond the leaf's end is kept but ends nothing.
void intersect(Ray ray, inout State state, inout Hit hit) {
    test_triangle(ray, reference_triangle(state.cursor), hit);
    ++state.cursor;
    if (search_over(hit)) {
        state.phase = DONE;
    } else if (state.cursor == state.end) {
        leave_leaf(state, hit);
    }
}
