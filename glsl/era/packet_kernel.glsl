// The text of one packet kernel, as it appears inside a loop. A card's compiler counts the instructions;
// the text never runs. packet_loop.glsl runs the same kernels. For single rays, pass.glsl with IN_LOOP
// gives the text to count.
//
// The loop keeps the state in registers and writes only hits. Here each kernel writes exactly the fields
// that it changes. With fewer fields, the compiler would drop computations; with more, it would add moves.
// The hits of four rays fill all targets, so `intersect` writes its cursor, the position in the leaf's
// list, as a depth. Two things are not counted: constants that a kernel sets, and the comparison that ends
// the loop over a leaf's triangles, which is part of the loop's branch.

#define int float
#define ivec3 vec3
#define ivec4 vec4

#include <streams>
#include <tables>
#include "core/phase.glsl"
#include <method>

void main() {
    Packet_rays rays = packet_rays_load();
    State state = state_load();
    Hit hit = hit_load();
    KERNEL(rays, state, hit);
#ifdef WRITES_HIT
    hit_store(hit);
    gl_FragDepth = state.place;
#else
    state_store(state);
#endif
}
