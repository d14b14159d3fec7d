// Phases of a ray. In phase k > 0 the ray waits for kernel k of the method's row in the method table. For
// example, a ray in phase DOWN waits for the kernel `down`. In the other phases, k <= 0, the ray has ended.

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
const int OVERFLOWN = -2;    // stopped by a full stack
