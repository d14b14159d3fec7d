// A packet: RAYS rays that one fragment traces together, PACKET_WIDTH x PACKET_HEIGHT texels of the
// ray textures.

const ivec2 PACKET_SIZE = ivec2(PACKET_WIDTH, PACKET_HEIGHT);
const int RAYS = PACKET_WIDTH * PACKET_HEIGHT;

// A ray's hit as a packet hands it on, and whether the ray is settled. In PAIRS a target holds two
// rays' t and triangle, else one ray's whole hit; a ray that was left behind is marked beside its
// triangle, by the highest bit or by a negative number.

#ifdef PAIRS

const uint UNSETTLED = 0x80000000u;

uvec2 packed_hit(Hit hit, bool settled) {
    return uvec2(floatBitsToUint(hit.t), uint(hit.triangle) | (settled ? 0u : UNSETTLED));
}

// u and v are not there.
Hit unpacked_hit(uvec2 texel, out bool settled) {
    settled = (texel.y & UNSETTLED) == 0u;
    return Hit(uintBitsToFloat(texel.x), 0.0, 0.0, int(texel.y & ~UNSETTLED));
}

#else

vec4 packed_hit(Hit hit, bool settled) {
    return vec4(hit.t, hit.u, hit.v, settled ? hit.triangle : -1 - hit.triangle);
}

Hit unpacked_hit(vec4 texel, out bool settled) {
    int triangle = int(texel.w);
    settled = triangle >= 0;
    return Hit(texel.x, texel.y, texel.z, settled ? triangle : -1 - triangle);
}

#endif
