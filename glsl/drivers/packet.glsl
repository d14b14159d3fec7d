// A packet: RAYS rays that one fragment traces together, PACKET_WIDTH x PACKET_HEIGHT texels of the
// ray textures.

const ivec2 PACKET_SIZE = ivec2(PACKET_WIDTH, PACKET_HEIGHT);
const int RAYS = PACKET_WIDTH * PACKET_HEIGHT;

// A ray's hit as a packet hands it on, and whether the ray is settled. With ROWS_ALONE a target holds
// for four rays which row of the triangle table each hits. With FOURS it holds one of four numbers of
// their hits, so that what is read of 4x2 rays lies as it will be asked for, or with TRIANGLES_ALONE of
// four triangles, there being nothing else; else one ray's whole hit.
// The highest bit beside the triangle marks a ray that was left behind.

const uint UNSETTLED = 0x80000000u;

#ifdef ROWS_ALONE

uint packed_row(int row, bool settled) {
    return uint(row) | (settled ? 0u : UNSETTLED);
}

int unpacked_row(uint texel, out bool settled) {
    settled = (texel & UNSETTLED) == 0u;
    return int(texel & ~UNSETTLED);
}

#else

vec4 packed_hit(Hit hit, bool settled) {
    uint triangle = floatBitsToUint(float(hit.triangle)) | (settled ? 0u : UNSETTLED);
    return vec4(hit.t, stored(hit.u), stored(hit.v), uintBitsToFloat(triangle));
}

Hit unpacked_hit(vec4 texel, out bool settled) {
    settled = (floatBitsToUint(texel.w) & UNSETTLED) == 0u;
    return Hit(texel.x, texel.y, texel.z, int(abs(texel.w)));
}

#endif
