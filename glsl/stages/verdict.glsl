// The verdict on a triangle that may lie in front of the triangle shown by the rasteriser.

const int BEHIND = 0;     // no ray hits the triangle before the shown triangle
const int BEFORE = 1;     // a ray hits the triangle before the shown triangle
const int MANY = 2;       // undecided: the triangle covers too many pixels, so the host searches in parts
