// The shared part of all packet walks through a BVH: the turns of the rays (drivers/packet_turns.glsl), and
// the tests of a leaf's triangles. The walks, bvh_packet.glsl (with a stack) and bvh_packet_threads.glsl
// (along escape indices), define `start_walk`, `walk_on` and `step_packet`.
//
// Options choose the files in drivers/ behind <triangle_tests> (triangle_by_ray or triangle_by_axes),
// <box_tests> (boxes_by_ray or boxes_by_interval) and <culling> (cull_nothing or vertex_culling).

#define PRESENT(r) (rays[r].t_min < NEVER)

#include "core/quantised.glsl"
#include "core/lockstep.glsl"
#include "drivers/packet_turns.glsl"
#include <triangle_tests>
#include <box_tests>
#include <culling>

uniform int node_count;

bool through = false;   // whether the walk of the current turn has ended
bool any_left;

// Turns ------------------------------------------------------------------------------------------

bool is_settled(int r) {
    return t_turn[r] == NEVER && (through || rays[r].t_min == NEVER);
}

void start_ray(int r) {
    Ray ray = rays[r];
    octant[r] = octant_of(ray) + shared_axis(ray);
    t_turn[r] = node_count > 0 && ray.t_min <= ray.t_max ? ray.t_min : NEVER;
    rays[r].t_min = NEVER;
}

void start_packet() {
    EACH(start_ray)
}

void take_turn(int r) {
    bool comes = octant[r] == turn && begins_near(r);
    rays[r].t_min = comes ? t_turn[r] : through ? NEVER : rays[r].t_min;
    t_turn[r] = comes ? NEVER : t_turn[r];
}

void start_walk();
void walk_on(int most);

// Begin the turn: walk from the start node to the first leaf.
void begin_turn() {
    find_neighbourhood();
    EACH(take_turn)
    EACH(find_start)
    bound_rays();
    bound_frustum();
    start_walk();
    walk_on(step_limit);
}

// Leaves -----------------------------------------------------------------------------------------

// Settle a shadow ray that has a hit.
void leave_ray(int r) {
    rays[r].t_min = search_over(hits[r]) ? NEVER : rays[r].t_min;
    any_left = any_left || rays[r].t_min < NEVER;
}

// Test the triangles of a leaf. Return false when all rays are settled, or at the step limit.
bool intersect(int first) {
    COUNT(leaves_visited);
    int next = first;
    do {
        tested = next;
        bool outside = culled(tested);
        while (outside && triangle_last(tested) == 0) {
            ++tested;
            outside = culled(tested);
        }
        if (!outside) {
            test_rays();
        }
        next = triangle_last(tested) != 0 ? -1 : tested + 1;
        ++steps;
    } while (next >= 0 && steps < step_limit);
    any_left = true;
#ifdef ANY_HIT
    any_left = false;
    EACH(leave_ray)
#endif
    bound_hits();
    return any_left && next < 0;
}
