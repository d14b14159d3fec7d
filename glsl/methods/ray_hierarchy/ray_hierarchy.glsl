// A hierarchy over rays: D. Roger, U. Assarsson, N. Holzschuch, "Whitted Ray-Tracing for Dynamic Scenes
// using a Ray-Space Hierarchy on the GPU", EGSR 2007 (survey, section 3.6). A node is a sphere around its
// rays' origins and a cone around their directions. The triangles need no acceleration structure.
//
// Departures: a node also holds `reach`, the largest distance that its rays still search. `reach` culls
// triangles behind nearer hits, triangles behind the ends of shadow rays, and all triangles if all rays of
// the node have ended. The hierarchy is rebuilt after every batch of triangles. Instead of the cone's
// angle, a node holds a chord: the largest distance between a ray's unit direction and the axis. A parent's
// chord is the largest sum of a child's chord and the distance between the two axes. A cosine would round
// the angle of a narrow cone to 0.

#include "methods/ray_hierarchy/cone_units.glsl"

const float ALL_DIRECTIONS = 1.9;    // a cone with a longer chord (2 at most) counts as all directions

Cone no_cone() {
    return Cone(vec3(0.0), 0.0, vec3(1.0, 0.0, 0.0), 0.0, -1.0);
}

// The exact direction lies within UNIT_ERROR of the stored direction. A ray with t_min < 0 also extends
// backwards, so its cone holds all directions.
Cone cone_of_ray(vec3 origin, vec3 direction, float t_min, float t_end) {
    float size = length(direction);
    float reach = max(t_end, abs(min(t_min, 0.0))) * size * unit * WIDENED;
    return Cone(unit * origin, 0.0, direction / size, t_min < 0.0 ? 2.0 : UNIT_ERROR, reach);
}

// The parent's sphere encloses the children's spheres. The centre is the middle of the box around these
// spheres. The parent's cone encloses the children's directions around their mean axis: |d - axis| <=
// |d - axis_i| + |axis_i - axis|. Radius and chord are measured from the rounded centre and axis.
// Differences and lengths have relative errors below 8 U, which WIDENED covers.
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

// Whether a ray of the node may hit a triangle in the ball (centre, radius). Let q be the vector from the
// sphere's centre to the ball's centre, h and w the parts of q along and across the axis, and s the sum of
// both radii. The ball must satisfy three conditions:
//   w cos a - h sin a <= s   The ball reaches the cone. For each half-angle a up to 180 degrees, the left
//                            side is at most the distance of the ball's centre from the cone.
//   |q| <= reach + s         The ball is not beyond the rays' ends.
//   -h <= s                  The ball is not behind the sphere. This condition applies only if a is at
//                            most 90 degrees.
//
// Rounding: q has a relative error of U. The errors of h and w are at most UNIT_ERROR * |q|, for an axis
// with an error of UNIT_ERROR. The error of cos a is 2 U, and sin a has a relative error of 16 U for chords
// below ALL_DIRECTIONS. The triangle test itself has an error of some tens of ARITHMETIC_UNIT times the
// distance from origin to corners (core/slack.glsl). This distance is at most |q| + s. SLACK is more than
// the sum of these errors. If a value is NaN, the result is true.
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
