// The verdict on a triangle that may come before the triangle that the rasteriser shows.

const int BEHIND = 0;     // no ray hits the triangle before the shown triangle
const int BEFORE = 1;     // a ray hits the triangle before the shown triangle
const int MANY = 2;       // the triangle covers many pixels and must be searched in parts
