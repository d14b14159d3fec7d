// What a ray waits for: phase k > 0 is the method's kernel k (the method's row numbers and names
// them, so that a kernel `down` is phase DOWN); the others wait for nothing.

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
const int OVERFLOWN = -2;    // stopped by a stack that is full
