// BOXES is the number of boxes that a packet tests on its way to the next leaf before it pauses.
//
// The software renderer llvmpipe runs several packets in lockstep, so a packet at a leaf waits for the
// slowest walk. A packet that has tested BOXES boxes without reaching a leaf therefore pauses, lets the
// other packets test their triangles, and then resumes. The first walk of a turn (packet_turns.glsl), from
// the start node to a leaf, does not pause: it is about equally long for all packets.
//
// When packets leave a loop early, llvmpipe also loses the values that only the last iteration of the loop
// computed. The walks therefore keep such values in variables that live across iterations.

const int BOXES = 12;
