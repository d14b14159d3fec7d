// Phases of a ray. For example, a ray in phase DOWN waits for the kernel `down`. Phases of ended rays:

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
const int OVERFLOWN = -2;    // stopped by a full stack
