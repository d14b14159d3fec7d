// Replaces shared_subtrees.glsl in a threaded BVH without shared subtrees. Here no walk needs `after`, the
// node after a shared subtree, and the compiler removes it.

pointer no_way_out;

#define AFTER(state) no_way_out
#define PORTAL(i) 0u

void order_corners(bvec3 negative, inout vec3 lo, inout vec3 hi) {
}

pointer behind(pointer escape, pointer after) {
    return escape;
}

pointer below(pointer node, pointer first) {
    return moved(node, 1);
}

pointer way_out(pointer first, pointer escape, pointer past, bool down, pointer after) {
    return after;
}
