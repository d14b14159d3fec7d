// What a kd-tree's node says of itself.

const int LEAF = 3;   // from here on an axis is a leaf's number
