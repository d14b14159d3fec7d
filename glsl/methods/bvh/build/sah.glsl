// What the passes of the SAH build share. Breadth-first, all nodes of a level in the same passes
// (C. Lauterbach et al., "Fast BVH Construction on GPUs", Eurographics 2009; survey section 3.5), by
// binned costs (I. Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007).
//
// Departures: bins are filled by drawing points that blend, and nodes of at most SMALL triangles try
// every place between two of them, as our CPU builder does; Lauterbach et al. give small nodes to
// local queues, which fragments do not have.

const float FAR = 3e38;
const int IN_ORDER = 3;   // the axis of a split by slots alone

float half_area(vec3 lo, vec3 hi) {
    vec3 size = max(hi - lo, 0.0);
    return size.x * size.y + size.y * size.z + size.z * size.x;
}

// What a node costs whose halves span these areas, in units of its own.
float split_cost(float left_area, float left, float right_area, float right, float whole) {
    float area = max(whole, 1e-37);
    return left_area / area * left + right_area / area * right;
}
