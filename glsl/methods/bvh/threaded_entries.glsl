// A ray walks along escape indices through the subtrees in its tile's list (stages/entry_points.frag). The
// walk of a subtree ends at the escape index of its root.

#include "stages/entry_list.glsl"

#define LEAVE ENTER

void begin(Ray ray, inout State state) {
    state.node = state.end = -1;
    state.entry = 0;
    state.phase = node_count > 0 ? ENTER : DONE;
}

bool subtree_ends(State state) {
    return state.node == state.end;
}

// Advance to the next subtree of the list, and visit its root.
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
