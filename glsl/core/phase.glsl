// Phases of a ray. In phase k > 0 the ray waits for the method's kernel k. The method's row in the method
// table names the kernels. For example, a ray in the phase DOWN waits for the kernel `down`. A ray in one
// of the following three phases has ended.

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
const int OVERFLOWN = -2;    // stopped by a full stack
