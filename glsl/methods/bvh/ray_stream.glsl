// Ray streams: I. Wald, C. Gribble, S. Boulos, A. Kensler, "SIMD Ray Stream Tracing - SIMD Ray Traversal
// with Generalized Ray Packets and On-the-fly Re-Ordering", Utah UUSCI-2007-012 (survey, section 4.3). Each
// node filters a stream of rays, and the rays that pass the filter are compacted. Unlike the rays of a
// packet, the rays of a stream do not wait for one another.
//
// Departures: in the paper the SIMD units of a CPU filter the stream of one node at a time, and a stack
// holds streams. Here a stream element is a ray with its current node, so that one pass filters the streams
// of all nodes. The element also holds the t at which the ray enters the node. The element is dropped if
// the ray has a hit before this t. Each ray goes to its nearer child first; in the paper all rays of a
// stream go to the same child first.

#include "core/quantised.glsl"
#include "methods/bvh/bvh_pairs.glsl"

// Return the children whose boxes the ray meets, the nearer child first, and the t at which the ray enters
// each box. NOTHING marks a missed child.
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
