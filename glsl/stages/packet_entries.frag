#version 330 core
// Entry points of packets: Reshetov, Soupikov, Hurley, "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005
// (survey, section 4.2). One fragment per tile of rays walks the tree with a beam, a bound of the rays. The
// fragment writes the node at which the tile's packets begin their walk.
//
// Departures: if the rays share an origin and the bounds of each tile's directions are known (BOUNDED), the
// beam contains all rays of the tile. Otherwise the beam surrounds only PROBES x PROBES rays of the tile,
// plus a margin, because reading all rays would cost more time than the entry saves. Such a beam may miss
// rays, so a packet begins at the entry only if an exact comparison shows that its rays lie within the beam
// (drivers/packet_entry.glsl). In the paper, the entry is the deepest node that holds every leaf that the
// beam meets. Here the beam descends while about half of its rays or more would follow, and the descent
// ends at the entry. With BOUNDED, no packet is traced in a tile whose beam meets nothing
// (drivers/packet_tiles.vert).

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "stages/tile_beam.glsl"

const int PROBES = 3;
#ifdef BOUNDED
const float MARGIN = 0.0;
#else
const float MARGIN = 0.125;   // share of the probes' extent
#endif
const int MOST_VISITS = 500;  // after so many visits, the tile's packets do the rest of the walk

uniform ivec2 ray_texture_size;

void widen(inout vec3 least, inout vec3 most) {
    vec3 margin = MARGIN * (most - least);
    least -= margin;
    most += margin;
}

// The beam around the rays of a tile, or around the probes and a margin. The margin does not change the
// signs of the directions.
Tile_beam beam_of(ivec2 tile) {
    Rays probe;
#ifdef BOUNDED
    Tile_bounds bounds = tile_bounds_load(tile);
    vec3 least = bounds.least;
    vec3 most = bounds.most;
    int live = bounds.live;
    probe = rays_load(min(TILE * tile, ray_texture_size - 1));
    Ray ray = ray_setup(probe);
    vec3 nearest = ray.hi_origin;
    vec3 farthest = ray.lo_origin;
    float t_min = ray.t_min;
#else
    vec3 nearest = vec3(BEAM_END);       // the smallest hi_origin of a probe
    vec3 farthest = vec3(-BEAM_END);     // the largest lo_origin of a probe
    vec3 least = vec3(BEAM_END);         // bounds of the directions' components
    vec3 most = vec3(-BEAM_END);
    float t_min = BEAM_END;
    int live = 0;
    for (int k = 0; k < PROBES * PROBES; ++k) {
        ivec2 place = ivec2(k % PROBES, k / PROBES) * (TILE - 1) / (PROBES - 1);
        probe = rays_load(min(TILE * tile + place, ray_texture_size - 1));
        Ray ray = ray_setup(probe);
        if (ray.t_min <= ray.t_max) {
            nearest = min(nearest, ray.hi_origin);
            farthest = max(farthest, ray.lo_origin);
            least = min(least, ray.direction);
            most = max(most, ray.direction);
            t_min = min(t_min, ray.t_min);
            ++live;
        }
    }
#endif
    bvec3 negative = lessThan(most, vec3(0.0));
    bvec3 positive = greaterThanEqual(least, vec3(0.0));
    widen(nearest, farthest);
    widen(least, most);
    probe.direction = mix(least, max(least, vec3(0.0)), positive);
    vec3 inv_hi = ray_setup(probe).inv_dir;
    probe.direction = mix(most, min(most, vec3(-TINY_DIRECTION)), negative);
    vec3 inv_lo = ray_setup(probe).inv_dir;
    ivec3 down = 1 - ivec3(positive);
    ivec3 up = 1 - ivec3(negative);
    int signs = down.x + 2 * down.y + 4 * down.z + 8 * (up.x + 2 * up.y + 4 * up.z);
    return Tile_beam(farthest, t_min, nearest, BEAM_END, inv_lo, signs, inv_hi, live);
}

// Find the node at which the packets of a beam's tile begin, and the links of the entry. The rays agree in
// their octant. The file <walk> defines this function.
void enter(Tile_beam beam, inout Packet_entry entry);

#include <walk>

void main() {
    Tile_beam beam = beam_of(ivec2(gl_FragCoord.xy));
    Packet_entry entry = Packet_entry(NO_LINK, NO_LINK, NO_LINK, NO_LINK, beam.inv_lo, NO_LINK,
                                      beam.inv_hi, beam.t_min, beam.lo_origin, 0, beam.hi_origin, 1);
#ifdef BOUNDED
    entry.met = beam.live;
#endif
    if (beam.live > 0 && !is_mixed(beam.signs)) {
        enter(beam, entry);
    }
    packet_entry_store(entry);
}
