#version 330 core
// Entry points: Reshetov, Soupikov, Hurley, "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005
// (survey, section 4.3). One fragment a tile of rays sends the tile's beam through the tree and
// leaves where its rays have to begin. With UPPER it goes through what the list of the larger tile
// around it names, else through the whole tree.
//
// Departure: the paper ends at one node, the deepest that holds every leaf its beam meets. In
// a bounding volume hierarchy, and for tiles that look along many subtrees, that node is soon the
// root; here a tile has a list of such nodes, each as deep as all its rays go.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/slack.glsl"
#include "stages/tile_beam.glsl"
#include "stages/entry_list.glsl"

const int MOST_VISITS = 2000;   // a beam that goes on for so long leaves the rest to its rays

int found[ENTRIES];
int entries = 0;
int visited = 0;

// Places are compared and not computed: softpipe writes neighbours' values of an array to one place.
void emit(int code) {
    for (int i = 0; i < ENTRIES; ++i) {
        found[i] = i == entries ? code : found[i];
    }
    ++entries;
}

// Fills the list for a beam whose rays agree in their octant, or do not matter in it.
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
