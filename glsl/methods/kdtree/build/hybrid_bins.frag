#version 330 core
// For each of four planes along each axis, counts the pieces of a chunk left and right of the plane. A
// piece is the part of a triangle in a node; a chunk is a part of a large node's pieces (zhou_chunks.frag).
// Each fragment reads the pieces of its chunk. The numpy builder fills histograms instead. A GPU would fill
// them by blending points, and many points would wait for the same few bins.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"
#include "methods/kdtree/build/hybrid_planes.glsl"

uniform int cells;

FIND_OWNER(chunk_owner, starts_load)

void main() {
    int number = element() / GROUPS, group = element() % GROUPS;
    int owner = chunk_owner(number, 3, 0, cells);
    Cell cell = cell_load(table_texel(owner));
    vec4 before = starts_load(table_texel(owner)).value;
    int begin = CHUNK * (number - int(before.w));
    int first = int(before.x) + begin;
    int end = first + min(CHUNK, cell.count - begin);
    Box box = box_load(table_texel(owner));
    vec4 x = group_planes(box, 0, group);
    vec4 y = group_planes(box, 1, group);
    vec4 z = group_planes(box, 2, group);
    Tallies found = Tallies(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    for (int i = first; i < end; ++i) {
        Piece piece = piece_load(table_texel(i));
        vec4 right = vec4(greaterThan(vec4(piece.hi.x), x));
        found.right_x += right;
        found.left_x += max(1.0 - right, vec4(lessThan(vec4(piece.lo.x), x)));
        right = vec4(greaterThan(vec4(piece.hi.y), y));
        found.right_y += right;
        found.left_y += max(1.0 - right, vec4(lessThan(vec4(piece.lo.y), y)));
        right = vec4(greaterThan(vec4(piece.hi.z), z));
        found.right_z += right;
        found.left_z += max(1.0 - right, vec4(lessThan(vec4(piece.lo.z), z)));
    }
    tallies_store(found);
}
