#version 330 core
// Rasterised bounds (survey, section 5: "if we know the bound of intersection points using rasterization,
// we can use this bound to reduce the number of ray traversal steps"). The method is the project's own.
// Triangles are drawn over a coarse image, one texel per tile of rays. MIN blending keeps three depths per
// texel: the least depth of any triangle, the greatest depth (negated), and the closing depth. A triangle
// that alone covers the whole tile stops every ray of the tile at or before the triangle's greatest depth.
// The closing depth is the least of these greatest depths.

#include <streams>
#include "stages/eye_triangle.glsl"

uniform float tile;

flat in vec3 corner_a;
flat in vec3 corner_b;
flat in vec3 corner_c;

// Return the least and the greatest height of the tile's four corner directions over the plane through an
// edge and the eye, and a bound on the error of these heights.
vec3 edge_heights(vec3 a, vec3 b, float sign, float size, vec3 d[4], float longest) {
    vec3 edge = b - a;
    vec3 normal = sign * cross(a, edge);
    vec4 height = vec4(dot(normal, d[0]), dot(normal, d[1]), dot(normal, d[2]), dot(normal, d[3]));
    return vec3(min(min(height.x, height.y), min(height.z, height.w)),
                max(max(height.x, height.y), max(height.z, height.w)),
                MARGIN * size * length(edge) * longest);
}

// Whether all three corners lie outside the tile's pyramid, beyond its side through the directions d and e.
bool beyond(vec3 d, vec3 e, float size) {
    vec3 side = cross(d, e);
    vec3 inside = vec3(dot(side, corner_a), dot(side, corner_b), dot(side, corner_c));
    return most(inside) < -MARGIN * size * length(d) * length(e);
}

void main() {
    vec2 lo = tile * floor(gl_FragCoord.xy);
    vec2 hi = min(lo + tile, image);
    vec3 d[4] = vec3[4](eye_direction(lo), eye_direction(vec2(hi.x, lo.y)),
                        eye_direction(vec2(lo.x, hi.y)), eye_direction(hi));
    float longest = max(max(length(d[0]), length(d[1])), max(length(d[2]), length(d[3])));
    float size = farthest(corner_a, corner_b, corner_c);
    vec3 z = depths(corner_a, corner_b, corner_c);
    float least_z = least(z) - MARGIN * size;
    float most_z = most(z) + MARGIN * size;
    vec3 ab = corner_b - corner_a;
    vec3 ac = corner_c - corner_a;
    vec3 normal = cross(ab, ac);
    float turn = MARGIN * size * (length(ab) + length(ac));   // the error of the normal
    float height = dot(normal, corner_a);                     // height of the eye over the plane
    bool closes = false;
    // The four calls of `beyond` follow the tile's outline, in the direction from `right` to `-up` (see
    // eye_direction). The cross product in `beyond` then points into the pyramid.
    if (beyond(d[0], d[1], size) || beyond(d[1], d[3], size) || beyond(d[3], d[2], size)
            || beyond(d[2], d[0], size)) {
        discard;
    }
    if (abs(height) > turn * size) {   // otherwise the triangle is seen edge-on
        float sign = height < 0.0 ? -1.0 : 1.0;
        vec3 one = edge_heights(corner_a, corner_b, sign, size, d, longest);
        vec3 two = edge_heights(corner_b, corner_c, sign, size, d, longest);
        vec3 three = edge_heights(corner_c, corner_a, sign, size, d, longest);
        if (one.y < -one.z || two.y < -two.z || three.y < -three.z) {
            discard;
        }
        closes = one.x > one.z && two.x > two.z && three.x > three.z;
        height = abs(height);
        vec4 fall = sign * vec4(dot(normal, d[0]), dot(normal, d[1]), dot(normal, d[2]),
                                dot(normal, d[3]));
        float least_fall = min(min(fall.x, fall.y), min(fall.z, fall.w)) - turn * longest;
        float most_fall = max(max(fall.x, fall.y), max(fall.z, fall.w)) + turn * longest;
        if (most_fall > 0.0) {
            least_z = max(least_z, (height - turn * size) / most_fall * (1.0 - MARGIN));
        }
        if (least_fall > 0.0) {
            most_z = min(most_z, (height + turn * size) / least_fall * (1.0 + MARGIN));
        }
    }
    depth_bounds_store(Depth_bounds(least_z, closes ? most_z : FAR_AWAY, -most_z));
}
