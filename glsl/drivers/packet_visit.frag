#version 330 core
// A step of packets under the schedule `step`. One fragment runs one kernel of one packet. A pass with one
// fragment for each ray (drivers/packet_intersect.frag) has done the rays' part of the step.
//
// The file <method> is the same as under `loop`. The file <stepwise> defines functions that work on
// `packet`, the packet's state:
//   `start_steps` sets up the fields of the walk, and the first phase.
//   `load_walk` loads the walk into the variables of <method>, and `store_walk` stores it.
//   A function for each kernel runs the kernel and sets the next phase.

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

Packet_state packet;

#include <stepwise>

#define RUN(number, kernel) \
    if (phase == number) { \
        kernel(); \
    }

void main() {
    EACH(load)
#ifdef START
    CLEAR_COUNTERS;
    start_steps();
#else
    packet = packet_state_load(ivec2(gl_FragCoord.xy));
    LOAD_COUNTERS(ivec2(gl_FragCoord.xy));
    steps = packet.steps;
    load_walk();
    int phase = packet.phase;
    EACH_KERNEL(RUN)
    if (packet.phase > DONE && steps >= step_cap) {
        packet.phase = UNFINISHED;
    }
#endif
    packet.steps = steps;
    store_walk();
    packet_state_store(packet);
    STORE_COUNTERS;
}
