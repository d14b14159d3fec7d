// Advances a ray of a BVH packet under the schedule `step`. The packet walks; the ray tests triangles.

#include "drivers/packet_turns.glsl"

State step_ray() {
    bool present = rays[0].t_min <= rays[0].t_max && octant_of(rays[0]) == packet.turn;
    if (packet.phase == INTERSECT && present && !search_over(hits[0])) {
        test_triangle(rays[0], packet.cursor, hits[0]);
    }
    return State(packet.phase, packet.steps);
}
