// Phases of a ray. In phase k > 0 the ray waits for kernel k of the method's row in the method table; in
// phase DOWN, for example, for the kernel `down`. In the following phases a ray has ended.

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
const int OVERFLOWN = -2;    // stopped by a full stack
