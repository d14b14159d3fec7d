// Layout of hits in render targets: target k holds the hit of ray k of the packet.

#define TARGET vec4
#define TARGET_SAMPLER sampler2D

#define STORE(k) packet_target[k] = numbers[k];

// READ(k) runs for each target k and keeps the hit of ray r.
#define READ(k) texel = k == r ? TEXEL(packet_texels_##k, packet_step, packet) : texel;
#define HIT_OF(texel) unpacked_hit(texel, settled)
