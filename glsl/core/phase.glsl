// Phases of a ray. In phase k > 0 the ray waits for kernel k of its method: in phase DOWN, for `down`.

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
const int OVERFLOWN = -2;    // stopped by a full stack
