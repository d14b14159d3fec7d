// A BVH whose inner nodes hold the boxes of both children, so that a step at one node fetches both boxes.
// Nodes are float texels or quantised texels (see bvh_nodes.glsl). A child number below 0 names a leaf,
// whose triangles begin at -1 - child.

uniform int root;

const int NOTHING = 1 << 24;   // no child; larger than the number of every node

bool is_leaf(int child) {
    return child < 0;
}

int first_triangle(int child) {
    return -1 - child;
}

#ifdef QUANTISED_NODES

vec3 bvh_pair_left_lo(int i) {
    return decoded(quantised_pair_left_lo_x(i), quantised_pair_left_lo_y(i),
                   quantised_pair_left_lo_z(i));
}

vec3 bvh_pair_left_hi(int i) {
    return decoded(quantised_pair_left_hi_x(i), quantised_pair_left_hi_y(i),
                   quantised_pair_left_hi_z(i));
}

vec3 bvh_pair_right_lo(int i) {
    return decoded(quantised_pair_right_lo_x(i), quantised_pair_right_lo_y(i),
                   quantised_pair_right_lo_z(i));
}

vec3 bvh_pair_right_hi(int i) {
    return decoded(quantised_pair_right_hi_x(i), quantised_pair_right_hi_y(i),
                   quantised_pair_right_hi_z(i));
}

int bvh_pair_left(int i) {
    int target = int(quantised_pair_left(i));
    return quantised_pair_left_leaf(i) != 0u ? -1 - target : target;
}

int bvh_pair_right(int i) {
    int target = int(quantised_pair_right(i));
    return quantised_pair_right_leaf(i) != 0u ? -1 - target : target;
}

#endif
