#version 330 core
// Entry points: Reshetov, Soupikov, Hurley, "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005 (survey,
// section 4.2). One fragment per tile walks the tree with a beam that bounds the tile's rays. The fragment
// writes the nodes at which these rays begin their search. With UPPER, the beam walks only the subtrees in
// the list of the enclosing larger tile; otherwise, it walks the whole tree.
//
// Departure: in the paper a tile's rays begin at one node, the deepest node that holds every leaf that the
// beam meets. In a bounding volume hierarchy, and for tiles whose rays pass many subtrees, this node is
// often the root. Here a tile has a list: the deepest nodes to which the rays of the tile descend together.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/slack.glsl"
#include "stages/tile_beam.glsl"
#include "stages/entry_list.glsl"

const int MOST_VISITS = 2000;   // after so many visits, the tile's rays do the rest of the walk

int found[ENTRIES];
int entries = 0;
int visited = 0;

// Append an entry. Compare each index, because softpipe uses one computed index for neighbouring fragments.
void emit(int code) {
    for (int i = 0; i < ENTRIES; ++i) {
        found[i] = i == entries ? code : found[i];
    }
    ++entries;
}

// Fill the tile's list. The file <walk> defines this function.
void walk(Tile_beam beam, ivec2 tile);

#include <walk>

#define LIST(k) ivec4(found[4 * k], found[4 * k + 1], found[4 * k + 2], found[4 * k + 3])

void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy);
    Tile_beam beam = tile_beam_load(tile);
    for (int i = 0; i < ENTRIES; ++i) {
        found[i] = LIST_END;
    }
    if (beam.live > 0) {
        walk(beam, tile);
    }
    entries_store(Entries(EACH_LIST(LIST), visited, entries));
}
