#version 330 core
// Draws a pair of a triangle and a tile of rays as the tile's square. If no ray of the tile can meet the
// triangle, the square moves outside the image, so the fragment stage does not see this pair. Triangles
// are drawn in the order of their indices, each triangle once for each tile.
//
// With `equal` (the second draw), triangles beyond the ends of the rays are not rejected. The ends come
// from the stored t of the first draw, and a very small t loses bits in storage. The ray may then end
// before its nearest triangle, which a rejection would lose.
//
// Departure: with POINTS the square is a point as large as the tile. For a point this program runs once for
// each pair, and for a quad four times.

#include <constants>
#include "core/fetch.glsl"
#include <sources>
#include <tables>
#include "methods/ray_tiles/cone.glsl"

uniform int first_triangle;
uniform bool equal;       // whether this is the second draw
uniform ivec2 tiles;      // number of tiles across and down

flat out int triangle;

void main() {
    int count = tiles.x * tiles.y;
#ifdef POINTS
    int pair = gl_VertexID;
    vec2 place = vec2(0.5);
    gl_PointSize = float(TILE);
#else
    int pair = gl_InstanceID;
    vec2 place = vec2(gl_VertexID & 1, gl_VertexID >> 1);
#endif
    triangle = first_triangle + pair / count;
    int number = pair % count;
    ivec2 tile = ivec2(number % tiles.x, number / tiles.x);
    Tile_cone cone = tile_cone_load(tile);
    Tile_end end = tile_end_load(tile);
    gl_Position = vec4((vec2(tile) + place) * 2.0 / vec2(tiles) - 1.0, 0.0, 1.0);
    if (cone_misses(cone.apex, cone.radius, cone.axis, cone.cosine, end.reach, !equal, end.lines != 0,
                    triangle_v0(triangle), triangle_v1(triangle), triangle_v2(triangle))) {
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    }
}
