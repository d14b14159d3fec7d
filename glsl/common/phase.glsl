// What a ray waits for: phase k > 0 is the method's kernel k (the method's row numbers and names
// them, so that a kernel `down` is phase DOWN); DONE and UNFINISHED wait for nothing.

const int DONE = 0;
const int UNFINISHED = -1;   // stopped by the step cap
