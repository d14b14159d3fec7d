// Layout of hits in render targets: a target holds only the triangles of four rays' hits, which is all that
// shadow rays need.

#define TARGET vec4
#define TARGET_SAMPLER sampler2D

#define TRIANGLE(k, r) numbers[4 * k + r].w
#define STORE(k) packet_target[k] = vec4(TRIANGLE(k, 0), TRIANGLE(k, 1), TRIANGLE(k, 2), TRIANGLE(k, 3));

// READ(k) runs for each target k and keeps the triangle of ray r.
#define READ(k) texel.w = k == r / 4 ? TEXEL(packet_texels_##k, packet_step, packet)[r % 4] : texel.w;
#define HIT_OF(texel) unpacked_hit(texel, settled)
