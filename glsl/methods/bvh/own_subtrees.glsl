// Replaces shared_subtrees.glsl in a threaded BVH without shared subtrees. Here no walk needs `after`, the
// node after a shared subtree, and the compiler removes it.

int no_way_out;

#define AFTER(state) no_way_out
#define PORTAL(i) 0u

void order_corners(bvec3 negative, inout vec3 lo, inout vec3 hi) {
}

int behind(int escape, int after) {
    return escape;
}

int below(int node, int first) {
    return node + 1;
}

int way_out(int first, int escape, int past, bool down, int after) {
    return after;
}
