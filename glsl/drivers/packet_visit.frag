#version 330 core
// A step of packets under the schedule `step`: one texel a packet. A packet visits one node, or leaves
// the triangle that its rays have just tested (drivers/packet_intersect.frag, one fragment a ray), or
// takes up what its stack holds. The kernels are bvh_packet.glsl's own.
//
// `turns` has a bit for each octant whose rays are still to come. Departure: with INTERVAL_TEST a whole
// octant is awake at once, as which of its rays begin near one another would be more state.

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
#ifndef OCTANTS
#include "core/tiles.glsl"
#endif

uniform int step_cap;

State state;

void find_octant(int r) {
    state.turns |= node_count > 0 && rays[r].t_min <= rays[r].t_max ? 1 << octant_of(rays[r]) : 0;
}

// Of the rays here: those whose turn it is, and that have not found any hit.
void wake(int r) {
    hits[r] = hit_load(min(ray_texel(r), ray_texture_size - 1));
    bool awake = rays[r].t_min <= rays[r].t_max && octant_of(rays[r]) == turn && !search_over(hits[r]);
    rays[r].t_min = awake ? rays[r].t_min : NEVER;
    any_left = any_left || awake;
}

// The next octant's walk from the root, or the end.
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

// On to where `node` points, or to what the stack holds, or to the end of the walk.
void go_on() {
#ifdef OCTANTS
    state.phase = TRAVERSE;
    if (node < 0) {
        end_walk();
    }
#else
    if (node == NOTHING && stacked == 0) {
        end_walk();
    } else {
        state.phase = node == NOTHING ? POP : is_leaf(node) ? INTERSECT : TRAVERSE;
        state.cursor = first_triangle(node);
    }
#endif
}

void traverse() {
#ifdef OCTANTS
    int leaf = visit();
    if (leaf >= 0) {
        state.phase = INTERSECT;
        state.cursor = leaf;
    } else {
        go_on();
    }
#else
    // A root that is a leaf has not been visited as any node's child.
    state.far = NOTHING;
    if (!is_leaf(node)) {
        state.far = visit();
    }
    go_on();
    if (state.far != NOTHING) {
        state.phase = PUSH;
    }
#endif
}

// The rays have tested the triangle at the cursor.
void leave_triangle() {
    ++steps;
#ifdef STATISTICS
    counters.triangles_tested += RAYS;
#endif
    bool last = triangle_last(state.cursor) != 0;
    ++state.cursor;
    if (!any_left) {
        end_walk();
    } else if (last) {
        COUNT(leaves_visited);
#ifndef OCTANTS
        node = NOTHING;
#endif
        go_on();
    }
}

void main() {
#ifdef START
#ifdef STATISTICS
    counters = Counters(0, 0, 0);
#endif
    state.cursor = state.turns = 0;
#ifndef OCTANTS
    state.far = 0;
    state.far_t_max = 0.0;
#endif
    EACH(load)
    EACH(find_octant)
    begin_walk();
#else
    state = state_load(ivec2(gl_FragCoord.xy));
#ifdef STATISTICS
    counters = counters_load(ivec2(gl_FragCoord.xy));
#endif
    steps = state.steps;
    node = state.node;
    turn = state.turn;
#ifndef OCTANTS
    stacked = state.stacked;
#elif defined(SHARED_SUBTREES)
    after = state.after;
#endif
    EACH(load)
    any_left = false;
    EACH(wake)
#ifdef INTERVAL_TEST
    bound_rays();
#endif
    if (state.phase == TRAVERSE) {
        traverse();
    } else if (state.phase == INTERSECT) {
        leave_triangle();
#ifndef OCTANTS
    } else if (state.phase == PUSH) {
        ++stacked;
        go_on();
    } else if (state.phase == POP) {
        --stacked;
        node = stack_entry_load(tile_corner(stacked) + ivec2(gl_FragCoord.xy)).node;
        go_on();
#endif
    }
    if (state.phase > DONE && steps >= step_cap) {
        state.phase = UNFINISHED;
    }
#endif
    state.steps = steps;
    state.node = node;
#ifndef OCTANTS
    state.stacked = stacked;
#elif defined(SHARED_SUBTREES)
    state.after = after;
#endif
    state_store(state);
#ifdef STATISTICS
    counters_store(counters);
#endif
}
