// Advances a ray of a kd packet by a step of the schedule `step`. The ray repeats the packet's last kernel
// for its own place in the tree, as a packet of one ray would. If the packet is at a triangle, the ray then
// tests the triangle. The method's file for `step` defines `repeat_traverse`, `repeat_leave` and
// `store_ray`.

#include <method>
#include <stepwise>

void repeat_kernel() {
    node = packet.from;
    turn = packet.turn;
    packet.turns |= packet.last == BEGIN ? 1 << turn : 0;   // restore the value from before the kernel
    load_packet();
    load_ray(0);
    if (packet.last == TRAVERSE) {
        repeat_traverse();
    } else if (packet.last == LEAVE) {
        repeat_leave();
    } else if (packet.last == BEGIN) {
        begin_turn();
    }
}

State step_ray() {
#ifdef START
    start_packet();
#else
    repeat_kernel();
#endif
    if (packet.phase == INTERSECT) {
        node = packet.node;
        tested = reference_triangle(packet.cursor);
        find_start(0);
        test_rays();
    }
    State state;
    state.phase = packet.phase;
    state.steps = packet.steps;
    store_ray(state);
    return state;
}
