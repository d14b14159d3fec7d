// A packet: RAYS rays that one fragment traces together, PACKET_WIDTH x PACKET_HEIGHT texels of the
// ray textures.

const ivec2 PACKET_SIZE = ivec2(PACKET_WIDTH, PACKET_HEIGHT);
const int RAYS = PACKET_WIDTH * PACKET_HEIGHT;
const uint UNSETTLED = 0x80000000u;   // beside the triangle of a ray that was left behind
