// Shared code of the passes of the SAH build. The build is breadth-first: the same passes handle all nodes
// of a level (C. Lauterbach et al., "Fast BVH Construction on GPUs", Eurographics 2009; survey, section 5).
// In large nodes, splits lie between bins (I. Wald, "On fast construction of SAH-based bounding volume
// hierarchies", 2007).
//
// Departures: each triangle is drawn as a point, and blending adds the triangle to a bin. A node of at most
// SMALL triangles tries every split between two triangles, as the CPU builder does; Lauterbach et al.
// process small nodes in local queues.

const float FAR = 3e38;
const int IN_ORDER = 3;   // in place of an axis: halve the node's list of triangles in its current order

float half_area(vec3 lo, vec3 hi) {
    vec3 size = max(hi - lo, 0.0);
    return size.x * size.y + size.y * size.z + size.z * size.x;
}

// The SAH cost of a split: area times count, summed over both children, divided by the node's area `whole`.
float split_cost(float left_area, float left, float right_area, float right, float whole) {
    float area = max(whole, 1e-37);
    return left_area / area * left + right_area / area * right;
}
