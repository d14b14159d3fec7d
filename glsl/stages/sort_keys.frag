#version 330 core
// What rays are sorted by: where a ray begins and where it would leave the scene. The survey proposes
// sorting rays (section 4.3) and leaves the key open; that an end belongs into it besides the origin
// is after Moon et al., "Cache-Oblivious Ray Reordering", TOG 2010, who take an estimate of the hit.
// Ours is where the ray leaves the scene's box, which costs no search.
//
// Both are cells of a cube, bit by bit, coarse ones first, the end's FREE_LEVELS behind the origin's:
// however many rays there are, as many bits of the key as tell them apart then part both alike. The
// bits are those of a Gray code: cells that follow on each other in it differ in one bit, so that a
// run of rays spans fewer cells than along the Morton curve. The first half of the levels is the first
// number of the key. Empty rays go last.

#include "core/precision.glsl"
#include <streams>
#include "core/stream.glsl"

uniform ivec2 ray_texture_size;
uniform vec3 scene_lo;
uniform vec3 scene_hi;

const int EMPTY = 1 << 23;
const float TINY = 1e-20;   // a component of a direction that is as good as none

// 0 to 2^LEVELS - 1 along each axis of the cube on a box's lower corner; an extent of nothing, or so
// little that its inverse overflows, has one cell. The clamp is for what lies on the upper faces or
// outside.
ivec3 cell_of(vec3 point, vec3 lo, vec3 hi) {
    vec3 extent = hi - lo;
    float per_unit = float(1 << LEVELS) / max(max(extent.x, extent.y), extent.z);
    float last = float((1 << LEVELS) - 1);
    return per_unit < 3e38 ? ivec3(clamp((point - lo) * per_unit, 0.0, last)) : ivec3(0);
}

// Where a ray leaves the scene's box; of one outside that misses it, somewhere on the ray.
vec3 end_of(Rays ray) {
    vec3 d = mix(ray.direction, vec3(TINY), lessThan(abs(ray.direction), vec3(TINY)));
    vec3 t = max((scene_lo - ray.origin) / d, (scene_hi - ray.origin) / d);
    return ray.origin + max(min(min(t.x, t.y), t.z), 0.0) * ray.direction;
}

void main() {
    int i = element();
    Rays ray = rays_load(ivec2(i % ray_texture_size.x, i / ray_texture_size.x));
    ivec3 begin = cell_of(ray.origin, low_load(ivec2(0)).value.xyz, -high_load(ivec2(0)).value.xyz);
    ivec3 end = cell_of(end_of(ray), scene_lo, scene_hi);
    int words[2] = int[](0, 0);
    int last = 0;
    for (int level = 0; level < LEVELS; ++level) {
        int bit = LEVELS - 1 - level;
        int word = level < LEVELS / 2 ? 0 : 1;
        for (int k = 0; k < (level < FREE_LEVELS ? 3 : 6); ++k) {
            last ^= k < 3 ? begin[k] >> bit & 1 : end[k - 3] >> (bit + FREE_LEVELS) & 1;
            words[word] = words[word] << 1 | last;
        }
    }
    bool empty = !(ray.t_min <= ray.t_max);
    sort_key_store(Sort_key(empty ? EMPTY : words[0], empty ? 0 : words[1], i));
}
