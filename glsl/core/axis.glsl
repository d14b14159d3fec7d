// Axes by number, as the nodes of kd-trees and similar trees store them.

const int LEAF = 3;   // stored in place of an axis; marks the node as a leaf

float along(int axis, vec3 v) {
    return axis == 0 ? v.x : (axis == 1 ? v.y : v.z);
}
