// How long a packet looks for its next leaf before it pauses.
//
// llvmpipe runs several packets in lockstep: a packet at a leaf waits for the slowest walk. A packet that
// has tested BOXES boxes without reaching a leaf therefore pauses, lets the others test their triangles,
// and then resumes its walk. The first walk of a packet, from the root to a leaf, does not pause: it is
// about equally long for all packets.
//
// llvmpipe also loses values that only the last iteration of a loop computed, for the packets that leave
// the loop early. The walks therefore hold such values in variables that live across iterations.

const int BOXES = 12;
