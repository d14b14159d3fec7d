// The three faces of a leaf that rays leave it by, of those that go down the axes in `down` and up the
// others, and the ropes behind them.

#include "methods/kdtree/kd.glsl"

vec3 faces_ahead(int leaf, bvec3 down) {
    return mix(kd_leaf_hi(leaf), kd_leaf_lo(leaf), down);
}

ivec3 ropes_ahead(int leaf, bvec3 down) {
    return ivec3(down.x ? kd_leaf_rope_lo_x(leaf) : kd_leaf_rope_hi_x(leaf),
                 down.y ? kd_leaf_rope_lo_y(leaf) : kd_leaf_rope_hi_y(leaf),
                 down.z ? kd_leaf_rope_lo_z(leaf) : kd_leaf_rope_hi_z(leaf));
}

// The rope of the face that a ray meets first, from where it crosses each.
int rope_taken(vec3 exits, float t_leave, ivec3 ropes) {
    return exits.x == t_leave ? ropes.x : exits.y == t_leave ? ropes.y : ropes.z;
}
