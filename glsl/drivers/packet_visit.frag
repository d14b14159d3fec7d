#version 330 core
// A step of packets under the schedule `step`. One fragment steps one packet. A packet visits a node,
// leaves a triangle, pushes or pops. Before a packet leaves a triangle, another pass has tested the
// triangle with one fragment for each ray (drivers/packet_intersect.frag).
//
// The file <method> is the method's own file, with `start_walk` and `visit`. The file <stepwise> defines
// the functions of a walk:
//   `clear_walk`, `load_walk` and `store_walk` handle the fields of the state that belong to the walk.
//   `go_on` continues at `node`, with a pop, or with the end of the walk.
//   `traverse` visits a node.
//   `leave_leaf` continues after the last triangle of a leaf.
//   `run_stack` pushes or pops.
//
// The field `turns` has a bit for each octant whose rays still wait. Departure from
// drivers/boxes_by_interval.glsl: with INTERVAL_TEST all rays of an octant walk at once, even rays that
// begin far from one another. Separating them would need more state.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/box.glsl"
#include "core/triangle.glsl"
#include "core/phase.glsl"
#include "drivers/packet.glsl"
#include "drivers/packet_rays.glsl"
#include <method>

uniform int step_cap;

State state;

void find_octant(int r) {
    state.turns |= node_count > 0 && rays[r].t_min <= rays[r].t_max ? 1 << octant_of(rays[r]) : 0;
}

// A ray stays present if the current turn is its turn and its search is not over.
void wake(int r) {
    hits[r] = hit_load(min(ray_texel(r), ray_texture_size - 1));
    bool awake = rays[r].t_min <= rays[r].t_max && octant_of(rays[r]) == turn && !search_over(hits[r]);
    rays[r].t_min = awake ? rays[r].t_min : NEVER;
    any_left = any_left || awake;
}

// Begin the next octant's walk at the root, or end the traversal.
void begin_walk() {
    state.turn = 0;
    while (state.turn < 8 && (state.turns >> state.turn & 1) == 0) {
        ++state.turn;
    }
    turn = state.turn;
    state.phase = state.turns == 0 ? DONE : TRAVERSE;
    start_walk();
}

void end_walk() {
    state.turns &= ~(1 << state.turn);
    begin_walk();
}

#include <stepwise>

// Go on after the rays have tested the triangle at the cursor.
void leave_triangle() {
    ++steps;
    COUNT_SEVERAL(triangles_tested, RAYS);
    bool last = triangle_last(state.cursor) != 0;
    ++state.cursor;
    if (!any_left) {
        end_walk();
    } else if (last) {
        COUNT(leaves_visited);
        leave_leaf();
    }
}

void main() {
#ifdef START
    CLEAR_COUNTERS;
    state.cursor = state.turns = 0;
    clear_walk();
    EACH(load)
    EACH(find_octant)
    begin_walk();
#else
    state = state_load(ivec2(gl_FragCoord.xy));
    LOAD_COUNTERS(ivec2(gl_FragCoord.xy));
    steps = state.steps;
    node = state.node;
    turn = state.turn;
    load_walk();
    EACH(load)
    any_left = false;
    EACH(wake)
    bound_rays();
    if (state.phase == TRAVERSE) {
        traverse();
    } else if (state.phase == INTERSECT) {
        leave_triangle();
    } else {
        run_stack();
    }
    if (state.phase > DONE && steps >= step_cap) {
        state.phase = UNFINISHED;
    }
#endif
    state.steps = steps;
    state.node = node;
    store_walk();
    state_store(state);
    STORE_COUNTERS;
}
