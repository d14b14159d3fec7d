// Ray streams: I. Wald, C. Gribble, S. Boulos, A. Kensler, "SIMD Ray Stream Tracing - SIMD Ray Traversal
// with Generalized Ray Packets and On-the-fly Re-Ordering", Utah UUSCI-2007-012 (survey, section 4.2).
// Rays do not wait for one another in packets: a stream of rays is filtered by each node, and what is
// left of it stands side by side again.
//
// Departures: there the stream of one node is filtered at a time, by SIMD units of a CPU, and a stack
// holds streams. Here an element is a ray with the node that it is at, so that one pass filters the
// streams of all nodes, and it knows where the ray enters that node: a hit nearer than that drops it.
// A ray goes to its nearer child first; there all rays of a stream take the same one.

#include "core/quantised.glsl"
#include "methods/bvh/bvh_pairs.glsl"

// The children that a ray is in, nearer first, or NOTHING; and where it enters them.
Visited visit(Ray ray, float t_hit, int node) {
    vec2 left = box_interval(ray, bvh_pair_left_lo(node), bvh_pair_left_hi(node));
    vec2 right = box_interval(ray, bvh_pair_right_lo(node), bvh_pair_right_hi(node));
    left.x = max(left.x, ray.t_min);
    right.x = max(right.x, ray.t_min);
    bool in_left = left.x <= min(left.y, t_hit);
    bool in_right = right.x <= min(right.y, t_hit);
    bool left_first = in_left && (!in_right || left.x <= right.x);
    int left_child = in_left ? bvh_pair_left(node) : NOTHING;
    int right_child = in_right ? bvh_pair_right(node) : NOTHING;
    return left_first ? Visited(left_child, left.x, right_child, right.x, 0, 0)
                      : Visited(right_child, right.x, left_child, left.x, 0, 0);
}
