// Phases of a ray. In phase k > 0 the ray waits for the method's kernel k. The method's row names its
// kernels. The phase of a kernel `down` is DOWN. The constants below mean that the ray has ended.

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
const int OVERFLOWN = -2;    // stopped by a full stack
