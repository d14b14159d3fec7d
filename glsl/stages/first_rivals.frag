#version 330 core
// Finds rivals. A triangle T is a rival if, in a part of the image, a ray hits T before the triangle that
// the rasteriser shows at the ray's pixel. The nested loops, from the outermost to the innermost, visit:
//   1. The squares of pixels that show a triangle other than T at a depth of at least d, where d is the
//      least depth of T in the square.
//   2. In these squares, the rows of pixels that the edges of T enclose.
//   3. The pixels of these rows that show a triangle other than T at a depth of at least d.
//   4. The rays of these pixels, which are tested against T.

#include "core/precision.glsl"
#include <streams>
#include "core/stream.glsl"
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"
#include "stages/cover.glsl"
#include "stages/verdict.glsl"

uniform int most_pixels;   // longest side of a searched rectangle; the host cuts larger rectangles
uniform int part_side;     // pixels per side of a part

const float HALF_DIAGONAL = 0.5 * sqrt(2.0) * float(BLOCK);
const float FAR_OFF = 1e6;

// The three edges as functions of a place, in pixels from an origin. The triangle can lie only where all
// three components of x * place.x + y * place.y + constant are at least 0.
struct Edges {
    vec3 x;
    vec3 y;
    vec3 constant;
};

vec3 edge(vec2 from, vec2 to, vec2 origin) {
    vec2 way = to - from;
    vec2 start = from - origin;
    return vec3(-way.y, way.x, way.y * start.x - way.x * start.y);
}

// The plane through the eye and an edge, as a function of a place in pixels.
vec3 edge_plane(vec3 from, vec3 to, vec2 origin) {
    vec3 plane = cross(from, to - from);
    vec2 along = plane.xy * 2.0 / size;
    return vec3(along, plane.z - plane.x - plane.y + dot(along, origin));
}

// `reach` bounds the distance from the corners to every place at which the edges are evaluated.
Edges edges_of(Cover cover, vec2 origin, float reach) {
    vec3 a = edge(cover.a, cover.b, origin);
    vec3 b = edge(cover.b, cover.c, origin);
    vec3 c = edge(cover.c, cover.a, origin);
    float turn = a.x * (cover.c.x - cover.a.x) + a.y * (cover.c.y - cover.a.y);
    vec3 lengths = vec3(length(a.xy), length(b.xy), length(c.xy));
    vec3 slack = (cover.beyond + cover.eta) * lengths + 2.0 * cover.eta * (reach + lengths);
    if (cover.cut) {
        a = edge_plane(cover.place_0, cover.place_1, origin);
        b = edge_plane(cover.place_1, cover.place_2, origin);
        c = edge_plane(cover.place_2, cover.place_0, origin);
        turn = dot(cross(cover.place_0, cover.place_1 - cover.place_0), cover.place_2);
        float axis = max(1.0, max(inversesqrt(dot(right, right)), inversesqrt(dot(up, up))));
        float across = 1.0 + dot(right, right) + dot(up, up);
        slack = vec3(16.0 * ERROR * cover.reach * cover.reach * axis * axis * across);
        // If the triangle is seen edge-on, the sign of `turn` is unreliable: accept every place.
        slack = abs(turn) > 16.0 * ERROR * cover.reach * cover.reach * cover.reach * axis * axis * axis
            ? slack : vec3(1e30);
    }
    float sign = turn < 0.0 ? -1.0 : 1.0;
    return Edges(sign * vec3(a.x, b.x, c.x), sign * vec3(a.y, b.y, c.y),
                 sign * vec3(a.z, b.z, c.z) + slack);
}

bool may_be(Edges edges, vec2 place, float around) {
    return least(edges.x * place.x + edges.y * place.y + edges.constant
                 + around * (abs(edges.x) + abs(edges.y))) >= 0.0;
}

// The first and the last x that the edges enclose in a row; the first is larger if they enclose none.
vec2 enclosed(Edges edges, vec3 inverse_x, float y) {
    vec3 rest = edges.y * y + edges.constant;
    vec3 end = -rest * inverse_x;
    vec3 lo = mix(vec3(-FAR_OFF), end, greaterThan(edges.x, vec3(0.0)));
    vec3 hi = mix(vec3(FAR_OFF), end, lessThan(edges.x, vec3(0.0)));
    vec3 none = mix(vec3(0.0), vec3(-1.0), equal(edges.x, vec3(0.0))) * step(rest, vec3(-1e-30));
    return vec2(greatest(lo), least(none) < 0.0 ? -FAR_OFF : least(hi));
}

bool any_of(ivec4 flags) {
    return (flags.x | flags.y | flags.z | flags.w) != 0;
}

void main() {
    Part part = part_load(table_texel(element()));
    int i = part.row;
    int index = triangle_index(i);
    Cover cover = cover_of(triangle_v0(i), triangle_v1(i), triangle_v2(i));
    ivec4 pixels = covered_pixels(cover);
    ivec2 corner = ivec2(part.x, part.y);
    pixels = ivec4(max(pixels.xy, corner), min(pixels.zw, corner + part_side - 1));
    ivec2 extent = max(pixels.zw - pixels.xy + 1, 0);
    bool many = extent.x > 0 && extent.y > 0 && max(extent.x, extent.y) > most_pixels;
    vec2 origin = vec2(pixels.xy) + 0.5;
    float corners = max(distance(cover.a, origin), max(distance(cover.b, origin),
                                                       distance(cover.c, origin)));
    Edges edges = edges_of(cover, origin, corners + length(vec2(extent)));
    vec3 inverse_x = 1.0 / edges.x;

    ivec4 squares = pixels / BLOCK;
    ivec2 next_square = squares.xy;
    bool squares_left = extent.x > 0 && extent.y > 0 && !many;
    int x = 0;                           // first column of the current square
    int y = 0;                           // next row of the current square
    int last_y = -1;                     // last row of the current square
    int next_four = 0;                   // the next four pixels of the row
    float least_here = 0.0;
    ivec2 first = ivec2(0);              // first pixel of the current four pixels
    ivec4 asked = ivec4(0);              // flags of the pixels whose rays must be tested
    bool before = false;
    bool left = squares_left;
    while (left && !before) {
        while (left && !any_of(asked)) {
            while (squares_left && y > last_y) {
                ivec2 square = next_square;
                next_square = square.x < squares.z ? ivec2(square.x + 1, square.y)
                                                   : ivec2(squares.x, square.y + 1);
                squares_left = next_square.y <= squares.w;
                Shown_block block = shown_block_load(square);
                vec2 middle = (vec2(square) + 0.5) * float(BLOCK);
                least_here = least_depth(cover, middle, HALF_DIAGONAL);
                bool own = block.lowest == index && block.highest == index;
                bool passed = own || least_here > block.depth
                    || !may_be(edges, middle - origin, 0.5 * float(BLOCK));
                x = square.x * BLOCK;
                y = max(square.y * BLOCK, pixels.y);
                last_y = passed ? -1 : min(square.y * BLOCK + BLOCK - 1, pixels.w);
                next_four = x;
            }
            vec2 ends = origin.x - 0.5 + enclosed(edges, inverse_x, float(y) + 0.5 - origin.y);
            int from = max(int(ceil(ends.x - 0.01)), pixels.x);
            int to = min(int(floor(ends.y + 0.01)), min(pixels.z, x + BLOCK - 1));
            first = ivec2(max(next_four, from & ~3), y);
            Shown_four shown = shown_four_load(ivec2(first.x >> 2, y));
            ivec4 at = first.x + ivec4(0, 1, 2, 3);
            // Use `&` to combine the flags, because a product of integers is slow in this hot loop.
            asked = ivec4(notEqual(shown.triangle, ivec4(index)))
                & ivec4(greaterThanEqual(shown.depth, vec4(max(least_here, 0.0))))
                & ivec4(greaterThanEqual(at, ivec4(from)))
                & ivec4(lessThanEqual(at, ivec4(y <= last_y ? to : -1)));
            next_four = first.x + 4;
            if (next_four > to) {
                next_four = x;
                ++y;
            }
            left = squares_left || y <= last_y || any_of(asked);
        }
        int k = asked.x != 0 ? 0 : asked.y != 0 ? 1 : asked.z != 0 ? 2 : 3;
        bool any_asked = any_of(asked);
        asked &= ivec4(notEqual(ivec4(0, 1, 2, 3), ivec4(k)));
        ivec2 pixel = min(first + ivec2(k, 0), ivec2(size) - 1);
        Hit shown = hit_load(pixel);
        Hit hit = shown;
        test_triangle(ray_setup(rays_load(pixel)), i, hit);
        before = any_asked && hit.triangle != shown.triangle;
        left = squares_left || y <= last_y || any_of(asked);
    }
    ivec4 parts = pixels / PART_SIDE;
    verdict_store(Verdict(many ? MANY : before ? BEFORE : BEHIND,
                          parts.x + 1024 * parts.y, parts.z + 1024 * parts.w));
}
