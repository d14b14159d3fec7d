// TEXEL(texels, step, pixel) reads a texel of a texture. `step` is the distance between two texels in texture
// coordinates. The macro samples at the texel's centre. The textures have one level and no filter, and the
// rounded centre lies within the texel. So even in divergent control flow, where derivatives are undefined,
// the sample is the texel that texelFetch returns. The macro avoids texelFetch because on llvmpipe texelFetch
// computes level and size for each lane and takes twice as many instructions. TEXEL_FETCH selects texelFetch,
// for the cost model of the cards of 2002-2006.

#ifdef TEXEL_FETCH
#define TEXEL(texels, step, pixel) texelFetch(texels, pixel, 0)
#else
#define TEXEL(texels, step, pixel) texture(texels, (vec2(pixel) + 0.5) * step)
#endif
