#version 330 core
// Lets through the packets that left rays behind: an occlusion query counts them. It reads the targets
// that hold triangles, with TRIANGLES_ALONE where those of t, u and v are others. Packets mark these
// rays beside their triangles, and not in a depth buffer: with one, a renderer on the CPU reads and
// blends what each packet writes over, at a fifth of the time that packets take which hit nothing.

#include "common/precision.glsl"
#include "common/fetch.glsl"
#include <streams>
#include "common/hit.glsl"
#include "common/packet.glsl"

#ifdef ROWS_ALONE
#define DECLARE(k) uniform usampler2D packet_texels_##k;
#else
#define DECLARE(k) uniform sampler2D packet_texels_##k;
#endif
EACH_TARGET(DECLARE)

// A texel, if it holds marks, has them in the highest bits of these.
#ifdef ROWS_ALONE
#define MARKED(texel) texel
#elif defined(TRIANGLES_ALONE)
#define MARKED(texel) floatBitsToUint(texel)
#else
#define MARKED(texel) uvec4(floatBitsToUint(texel.w))
#endif

#define READ(k) \
    left = left || any(greaterThanEqual(MARKED(TEXEL(packet_texels_##k, packet_step, packet)), \
                                        uvec4(UNSETTLED)));

void main() {
    ivec2 packet = ivec2(gl_FragCoord.xy);
    vec2 packet_step = 1.0 / vec2(textureSize(packet_texels_0, 0));
    bool left = false;
    EACH_TARGET(READ)
    if (!left) {
        discard;
    }
}
