// The verdict on a triangle that may come before the triangle that the rasteriser shows.

const int BEHIND = 0;     // the triangle comes before it nowhere
const int BEFORE = 1;     // the triangle comes before it somewhere
const int MANY = 2;       // the triangle covers many pixels and is to be searched in parts
