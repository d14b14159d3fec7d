// Selects the three faces through which rays can leave a leaf, and the ropes of these faces. The rays'
// coordinates decrease along the axes in `down`.

#include "core/pointer.glsl"
#include "methods/kdtree/kd.glsl"

struct Ropes {
    pointer x;
    pointer y;
    pointer z;
};

vec3 faces_ahead(pointer leaf, bvec3 down) {
    return chosen(down, kd_leaf_lo(leaf), kd_leaf_hi(leaf));
}

Ropes ropes_ahead(pointer leaf, bvec3 down) {
    return Ropes(down.x ? kd_leaf_rope_lo_x(leaf) : kd_leaf_rope_hi_x(leaf),
                 down.y ? kd_leaf_rope_lo_y(leaf) : kd_leaf_rope_hi_y(leaf),
                 down.z ? kd_leaf_rope_lo_z(leaf) : kd_leaf_rope_hi_z(leaf));
}

// The rope of the face that a ray meets first. `exits` holds the t at each face.
pointer rope_taken(vec3 exits, float t_leave, Ropes ropes) {
    return exits.x == t_leave ? ropes.x : exits.y == t_leave ? ropes.y : ropes.z;
}
