// A hierarchy over rays: D. Roger, U. Assarsson, N. Holzschuch, "Whitted Ray-Tracing for Dynamic Scenes
// using a Ray-Space Hierarchy on the GPU", EGSR 2007 (survey, 3.6.2). A node is a sphere that holds its
// rays' origins and a cone of their directions; no structure over the triangles is needed.
//
// Departures: a node knows as well how far its rays still go, so that nearer hits, shadow rays' ends and
// rays that are over cull what lies behind; it is made anew after every batch of triangles. Instead of
// the cone's angle it holds a chord, the largest distance of a unit direction from the axis: those add
// up along a way through the tree without cosines, which would round a narrow cone to none.

#include "methods/ray_hierarchy/cone_units.glsl"

const float ALL_DIRECTIONS = 1.9;    // a chord (of 2) past which a cone counts as the whole sphere

Cone no_cone() {
    return Cone(vec3(0.0), 0.0, vec3(1.0, 0.0, 0.0), 0.0, -1.0);
}

// The true direction lies within UNIT_ERROR of the one that is stored. A ray that begins behind its
// origin goes both ways.
Cone cone_of_ray(vec3 origin, vec3 direction, float t_min, float t_end) {
    float size = length(direction);
    float reach = max(t_end, abs(min(t_min, 0.0))) * size * unit * WIDENED;
    return Cone(unit * origin, 0.0, direction / size, t_min < 0.0 ? 2.0 : UNIT_ERROR, reach);
}

// A parent encloses its children's spheres around the middle of their common box, and their directions
// around the mean axis: |d - axis| <= |d - axis_i| + |axis_i - axis|. What is stored of a centre and an
// axis is exact by definition; differences and lengths err by less than 8 U, relatively, which WIDENED
// covers.
Cone cone_over(Cone children[4]) {
    vec3 lo = vec3(3e38), hi = vec3(-3e38), axis = vec3(0.0);
    float reach = -1.0;
    for (int k = 0; k < 4; ++k) {
        Cone child = children[k];
        if (child.reach >= 0.0) {
            lo = min(lo, child.centre - child.radius);
            hi = max(hi, child.centre + child.radius);
            axis += child.axis;
            reach = max(reach, child.reach);
        }
    }
    if (reach < 0.0) {
        return no_cone();
    }
    float size = length(axis);
    bool narrow = size > 0.01;
    Cone parent = Cone(0.5 * (lo + hi), 0.0, narrow ? axis / size : vec3(1.0, 0.0, 0.0),
                       narrow ? 0.0 : 2.0, reach);
    for (int k = 0; k < 4; ++k) {
        Cone child = children[k];
        if (child.reach >= 0.0) {
            parent.radius = max(parent.radius,
                                (length(child.centre - parent.centre) + child.radius) * WIDENED);
            parent.chord = max(parent.chord,
                               (length(child.axis - parent.axis) + child.chord) * WIDENED);
        }
    }
    parent.radius += TINY;
    return parent;
}

// Whether a ray of the node may hit a triangle in the ball (centre, radius): with q from the sphere's
// centre to the ball's, w across and h along the axis, the ball must reach the cone widened by both
// radii, s: the distance from a cone of half-angle a is at least w cos a - h sin a, whatever a is up to
// 180 degrees, and the rays' ends: |q| <= reach + s, and -h <= s if the cone opens forward.
//
// Rounding: q is exact but for U of itself, h and w err by at most UNIT_ERROR |q| for an axis that
// is off by that, cos a by 2 U and sin a by 16 U of itself below ALL_DIRECTIONS. The triangle test itself
// errs by some units of the distance from origin to corners, at most |q| + s, as a box's slack covers
// (slack.glsl). SLACK is more than all of them together. What is NaN is kept.
const float SLACK = 64.0 * ARITHMETIC_UNIT + 64.0 * U;

bool may_hit(vec4 ball, Cone cone) {
    vec3 q = ball.xyz - cone.centre;
    float far = length(q);
    float s = cone.radius + ball.w;
    s += SLACK * (far + s) + TINY;
    float chord = cone.chord + UNIT_ERROR;
    float cosine = 1.0 - 0.5 * chord * chord;
    float sine = chord * sqrt(max(1.0 - 0.25 * chord * chord, 0.0));
    float h = dot(q, cone.axis);
    float w = length(q - h * cone.axis);
    bool beside = chord < ALL_DIRECTIONS && w * cosine - h * sine > s;
    bool behind = cosine >= 0.0 && -h > s;
    return !(cone.reach < 0.0 || beside || behind || far > cone.reach + s);
}
