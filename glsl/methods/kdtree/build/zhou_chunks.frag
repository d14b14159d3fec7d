#version 330 core
// Computes the bounds of a chunk: up to CHUNK consecutive pieces (zhou.glsl) of a large node. Counts the
// chunk's pieces left and right of the node's middle along each axis. As in Zhou et al., later passes join
// the chunks of each node. A large node has many chunks, so it keeps all processors busy.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int cells;

FIND_OWNER(chunk_owner, starts_load)

void main() {
    int number = element();
    int owner = chunk_owner(number, 3, 0, cells);
    Cell cell = cell_load(table_texel(owner));
    vec4 before = starts_load(table_texel(owner)).value;
    int begin = CHUNK * (number - int(before.w));
    int first = int(before.x) + begin;
    int end = first + min(CHUNK, cell.count - begin);
    PRECISE vec3 middle = cell.lo + 0.5 * (cell.hi - cell.lo);
    Chunk chunk = Chunk(vec3(INFINITY), vec3(-INFINITY), vec3(0.0), vec3(0.0));
    for (int i = first; i < end; ++i) {
        Piece piece = piece_load(table_texel(i));
        chunk.lo = min(chunk.lo, piece.lo);
        chunk.hi = max(chunk.hi, piece.hi);
        chunk.left += max(vec3(lessThan(piece.lo, middle)), vec3(lessThanEqual(piece.hi, middle)));
        chunk.right += vec3(greaterThan(piece.hi, middle));
    }
    chunk_store(chunk);
}
