// What becomes of a triangle that may come before what the rasteriser shows.

const int BEHIND = 0;     // it does not, anywhere
const int BEFORE = 1;     // it does
const int MANY = 2;       // it covers many pixels: to be looked at in parts
