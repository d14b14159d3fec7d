// Axes by their number, as the nodes of kd-trees and of the like name theirs.

const int LEAF = 3;   // from here on an axis is a leaf's number

float along(int axis, vec3 v) {
    return axis == 0 ? v.x : (axis == 1 ? v.y : v.z);
}
