// A packet: RAYS rays that one fragment traces together, PACKET_WIDTH x PACKET_HEIGHT texels of the
// ray textures.

const ivec2 PACKET_SIZE = ivec2(PACKET_WIDTH, PACKET_HEIGHT);
const int RAYS = PACKET_WIDTH * PACKET_HEIGHT;

// A ray's hit as a packet hands it on, and whether the ray is settled. In PAIRS a target holds two
// rays' t and row of the triangle table, else one ray's whole hit. The highest bit beside the triangle marks a ray that
// was left behind.

const uint UNSETTLED = 0x80000000u;

#ifdef PAIRS

uvec2 packed_hit(float t, int row, bool settled) {
    return uvec2(floatBitsToUint(t), uint(row) | (settled ? 0u : UNSETTLED));
}

// A row, not an index, and no u and v.
Hit unpacked_hit(uvec2 texel, out bool settled) {
    settled = (texel.y & UNSETTLED) == 0u;
    return Hit(uintBitsToFloat(texel.x), 0.0, 0.0, int(texel.y & ~UNSETTLED));
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
