// Computes the part of a piece (zhou.glsl) on one side of a plane. If the piece lies on both sides, its new
// box is the box of the triangle's part on this side, widened by `slack` and cut to the old box.

#include "methods/kdtree/build/zhou.glsl"

uniform float slack;

bool lies_in(Piece piece, int axis, float plane, int side) {
    float lo = piece.lo[axis], hi = piece.hi[axis];
    return side == 0 ? lo < plane || hi <= plane : hi > plane;
}

// Replace the piece by its part on one side. Return false if this part is empty.
bool take_half(inout Piece piece, int axis, float plane, int side) {
    if (!lies_in(piece, axis, plane, side)) {
        return false;
    }
    if (lies_in(piece, axis, plane, 1 - side)) {
        Triangle triangle = triangle_load(table_texel(piece.triangle));
        vec3 vertex[3] = vec3[](triangle.v0, triangle.v1, triangle.v2);
        PRECISE float wide = side == 0 ? plane + slack : plane - slack;
        vec3 lo = vec3(INFINITY), hi = vec3(-INFINITY);
        for (int i = 0; i < 3; ++i) {
            vec3 start = vertex[i], end = vertex[(i + 1) % 3];
            bool starts_in = side == 0 ? start[axis] <= wide : start[axis] >= wide;
            bool ends_in = side == 0 ? end[axis] <= wide : end[axis] >= wide;
            if (starts_in) {
                lo = min(lo, start);
                hi = max(hi, start);
            }
            if (starts_in != ends_in) {
                PRECISE float share = (wide - start[axis]) / (end[axis] - start[axis]);
                PRECISE vec3 point = start + share * (end - start);
                lo = min(lo, point);
                hi = max(hi, point);
            }
        }
        piece.lo = max(lo - slack, piece.lo);
        piece.hi = min(hi + slack, piece.hi);
        if (side == 0) {
            piece.hi[axis] = min(piece.hi[axis], plane);
        } else {
            piece.lo[axis] = max(piece.lo[axis], plane);
        }
    }
    return all(lessThanEqual(piece.lo, piece.hi));
}
