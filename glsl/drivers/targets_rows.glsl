// Layout of hits in render targets: each channel of a target holds one ray's hit triangle, as a row of the
// triangle table. Packets with more rays than render targets need this layout. A later program tests the
// triangle again, and gets the same hit to the bit.

#define TARGET uvec4
#define TARGET_SAMPLER usampler2D

uint packed_row(int row, bool settled) {
    return uint(row) | (settled ? 0u : UNSETTLED);
}

Hit hit_of_row(uint texel, ivec2 pixel, out bool settled) {
    settled = (texel & UNSETTLED) == 0u;
    int row = int(texel & ~UNSETTLED);
    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
    if (row != NO_TRIANGLE) {
        test_triangle(ray, row, hit);
    }
    return hit;
}

#define ROW(r) packed_row(rows[r], is_settled(r))
#define STORE(k) packet_target[k] = uvec4(ROW(4 * k), ROW(4 * k + 1), ROW(4 * k + 2), ROW(4 * k + 3));

// READ(k) runs for each target k and keeps the texel with the row of ray r.
#define READ(k) texel = k == r / 4 ? TEXEL(packet_texels_##k, packet_step, packet) : texel;
#define HIT_OF(texel) hit_of_row(texel[r % 4], pixel, settled)
