// BOXES is the number of boxes that a packet tests on its way to the next leaf before it pauses.
//
// llvmpipe, the software renderer, runs several packets in lockstep, so a packet at a leaf waits for the
// slowest walk. A packet that has tested BOXES boxes therefore pauses, lets other packets test their
// triangles, and then resumes. The first walk of a turn (packet_turns.glsl), from the start node to a leaf,
// does not pause: it is about equally long for all packets.
//
// When packets leave a loop early, llvmpipe loses values that only the last iteration computed. Therefore
// the walks keep such values in variables outside the loop.

const int BOXES = 12;
