// The program of Horn et al. 2007: a fragment traces the four rays of a packet in one loop, with the state
// and the short stack in registers, and writes their hits. The kernels `traverse`, `intersect` and `pop`
// have inner loops.

#define int float
#define ivec3 vec3
#define ivec4 vec4

#include <streams>
#include <tables>
#include "core/phase.glsl"

uniform vec3 scene_lo;
uniform vec3 scene_hi;

#include <method>

// Load the rays of the packet. Component k of every vector belongs to ray k.
Packet_rays packet_rays() {
    vec2 corner = 2.0 * gl_FragCoord.xy;
    Rays a = rays_load(corner + vec2(-0.5, -0.5));
    Rays b = rays_load(corner + vec2(0.5, -0.5));
    Rays c = rays_load(corner + vec2(-0.5, 0.5));
    Rays d = rays_load(corner + vec2(0.5, 0.5));
    vec4 x = vec4(a.direction.x, b.direction.x, c.direction.x, d.direction.x);
    vec4 y = vec4(a.direction.y, b.direction.y, c.direction.y, d.direction.y);
    vec4 z = vec4(a.direction.z, b.direction.z, c.direction.z, d.direction.z);
    return Packet_rays(vec4(a.origin.x, b.origin.x, c.origin.x, d.origin.x),
                       vec4(a.origin.y, b.origin.y, c.origin.y, d.origin.y),
                       vec4(a.origin.z, b.origin.z, c.origin.z, d.origin.z), x, y, z,
                       1.0 / x, 1.0 / y, 1.0 / z, vec4(a.t_min, b.t_min, c.t_min, d.t_min),
                       vec4(a.t_max, b.t_max, c.t_max, d.t_max));
}

void main() {
    Packet_rays rays = packet_rays();
    State state;
    Hit hit = Hit(rays.t_max, ZERO, ZERO, vec4(NO_TRIANGLE));
    init(rays, state);
    while (state.phase != DONE) {
        if (state.phase == BEGIN) {
            begin(rays, state, hit);
        }
        while (state.phase == TRAVERSE) {
            traverse(rays, state, hit);
            if (state.far != FREE) {
                push(rays, state, hit);
            }
        }
        while (state.phase == INTERSECT) {
            intersect(rays, state, hit);
        }
        leave(rays, state, hit);
        while (state.phase == POP) {
            pop(rays, state, hit);
        }
    }
#ifdef DISCARDS_UNFINISHED
    // A renderer may stop a long loop silently. Discard the fragment, so that an occlusion query misses it.
    if (state.phase != DONE) {
        discard;
    }
#endif
    hit_store(hit);
}
