// A pass runs one kernel on each ray that waits for this kernel, as on cards without loops (Purcell et al.
// 2002; Foley and Sugerman 2005). The host chooses a kernel, masks the rays that wait for other kernels,
// and runs several passes; the early depth test rejects masked rays. If a pass changes a ray's phase, the
// remaining passes copy the ray unchanged. With START the pass sets up the rays' states.
//
// With IN_LOOP the text represents a kernel inside a loop, as on cards with branches (Horn et al. 2007). It
// does not test the phase, because the loop has already branched to the kernel. A card's compiler counts
// the instructions; the text never runs.
//
// Departures from drivers/traverse.frag: there are no integers, step counts or counters, and boxes are not
// widened. The triangle test is that of Moeller and Trumbore. At equal t, the triangle that is found first
// wins.

#define int float
#define ivec2 vec2
#define ivec3 vec3
#define ivec4 vec4

#include "core/precision.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "era/ray.glsl"
#include "core/hit.glsl"
#include "era/box.glsl"
#include "core/triangle.glsl"
#include "core/phase.glsl"
#include <method>

void main() {
    Ray ray = ray_setup(rays_load());
    State state;
    Hit hit;
#ifdef START
    hit = no_hit(ray.t_max);
    init(ray, state);
#else
    state = state_load();
    hit = hit_load();
#ifdef IN_LOOP
    KERNEL(ray, state, hit);
#else
    if (state.phase == KERNEL_PHASE) {
        KERNEL(ray, state, hit);
    }
#endif
#endif
    state_store(state);
#ifdef WRITES_HIT
    hit_store(hit);
#endif
}
