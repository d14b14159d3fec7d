#version 330 core
// Computes the sort key of a ray from the point where the ray begins and the point where it would leave the
// scene's box. Hachisuka's survey proposes to sort rays (section 4.3) but names no key. Moon et al.,
// "Cache-Oblivious Ray Reordering", TOG 2010, put both ends of a ray into the key; their second end is an
// estimate of the hit.
//
// Each end becomes a cell of a lattice: the origin in a cube around the box of all origins, the second end
// in a cube around the scene's box. The key interleaves the bits of the two cells, coarse levels first. The
// first FREE_LEVELS levels of the key come from the origin alone. After these levels, each level of the
// origin is followed by a level of the second end. The bits form a Gray code: cells with consecutive keys
// differ in one bit. In a Morton code, such cells may differ in all bits. A key consists of two numbers,
// each with half of the levels. Rays with an empty interval come last.

#include "core/precision.glsl"
#include <streams>
#include "core/stream.glsl"

uniform ivec2 ray_texture_size;
uniform vec3 scene_lo;
uniform vec3 scene_hi;

const int EMPTY = 1 << 23;
const float TINY = 1e-20;   // smaller components of a direction count as this value

// Return the cell of a point, 0 to 2^LEVELS - 1 along each axis. The cells divide a cube at the corner
// `lo`, whose side is the largest extent of the box from `lo` to `hi`. If this extent is 0 or its inverse
// overflows, there is a single cell.
ivec3 cell_of(vec3 point, vec3 lo, vec3 hi) {
    vec3 extent = hi - lo;
    float per_unit = float(1 << LEVELS) / max(max(extent.x, extent.y), extent.z);
    float last = float((1 << LEVELS) - 1);
    return per_unit < 3e38 ? ivec3(clamp((point - lo) * per_unit, 0.0, last)) : ivec3(0);
}

// Return the point where a ray leaves the scene's box; if the ray misses the box, another point on the ray.
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
