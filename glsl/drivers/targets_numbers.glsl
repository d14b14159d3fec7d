// Layout of hits in render targets: a target holds one of the four numbers of a hit, for four rays. These
// rays are neighbours in a row of the image. This is the order of the host's arrays.

#define TARGET vec4
#define TARGET_SAMPLER sampler2D

#define NUMBER(k, r) numbers[k / 4 * 4 + r][k % 4]
#define STORE(k) packet_target[k] = vec4(NUMBER(k, 0), NUMBER(k, 1), NUMBER(k, 2), NUMBER(k, 3));

// READ(k) runs for each target k and keeps the numbers of ray r.
#define READ(k) texel[k % 4] = k / 4 == r / 4 ? TEXEL(packet_texels_##k, packet_step, packet)[r % 4] : texel[k % 4];
#define HIT_OF(texel) unpacked_hit(texel, settled)
