// The cost of a split of a kd-tree node by the surface area heuristic, with the same operations as
// SplitCost in gpgpu_rt/methods/kdtree/sah.py. `left` and `right` count the triangles on the two sides.

uniform float traversal_cost;
uniform float intersection_cost;
uniform float spared;           // cost factor of a split that cuts off empty space
uniform float worth_cutting;    // smallest share of empty space for which `spared` applies

// `measure` sets these values of a node, one per axis. If `share` is the left child's share of the extent,
// a split costs traversal_cost + cap * (left + right) + rim * (share * left + (1 - share) * right).
vec3 node_lo, node_hi, cap, rim, per_unit;

void measure(vec3 lo, vec3 hi) {
    node_lo = lo;
    node_hi = hi;
    PRECISE vec3 size = hi - lo;
    per_unit = 1.0 / size;
    size = size / max(max(size.x, size.y), size.z);
    PRECISE vec3 sides = size * (size.yzx + size.zxy);
    PRECISE vec3 face = size.yzx * size.zxy;
    PRECISE vec3 scale = intersection_cost / (sides + face);
    cap = scale * face;
    rim = scale * sides;
}

float split_cost(int axis, float plane, float left, float right) {
    PRECISE float share = (plane - node_lo[axis]) * per_unit[axis];
    PRECISE float cost = cap[axis] * (left + right);
    PRECISE float within = share * left + (1.0 - share) * right;
    PRECISE float rest = rim[axis] * within;
    cost = cost + rest;
    cost = cost + traversal_cost;
    bool empty = (left == 0.0 && share >= worth_cutting)
        || (right == 0.0 && share <= 1.0 - worth_cutting);
    cost = empty ? cost * spared : cost;
    return plane > node_lo[axis] && plane < node_hi[axis] ? cost : INFINITY;
}
