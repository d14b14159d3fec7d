// A packet is the set of RAYS rays that one fragment traces together. The rays fill PACKET_WIDTH x
// PACKET_HEIGHT texels of the ray textures.

const ivec2 PACKET_SIZE = ivec2(PACKET_WIDTH, PACKET_HEIGHT);
const int RAYS = PACKET_WIDTH * PACKET_HEIGHT;

// A hit as four numbers. The highest bit of the triangle's number is set if the step limit stopped the
// ray's search.

const uint UNSETTLED = 0x80000000u;

vec4 packed_hit(Hit hit, bool settled) {
    uint triangle = floatBitsToUint(float(hit.triangle)) | (settled ? 0u : UNSETTLED);
    return vec4(hit.t, stored(hit.u), stored(hit.v), uintBitsToFloat(triangle));
}

Hit unpacked_hit(vec4 texel, out bool settled) {
    settled = (floatBitsToUint(texel.w) & UNSETTLED) == 0u;
    return Hit(texel.x, texel.y, texel.z, int(abs(texel.w)));
}
