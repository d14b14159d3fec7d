// TEXEL(texels, step, pixel) reads a texel at its centre. `step` is the distance between two texels in
// texture coordinates. The textures have one level and no filter, and the rounded centre lies within the
// texel. So `texture` returns the same texel as texelFetch. With one level, `texture` uses no derivatives,
// which may be undefined. On llvmpipe texelFetch computes level and size for each lane and takes twice as
// many instructions. TEXEL_FETCH selects texelFetch, for the cost model of the cards of 2002-2006.

#ifdef TEXEL_FETCH
#define TEXEL(texels, step, pixel) texelFetch(texels, pixel, 0)
#else
#define TEXEL(texels, step, pixel) texture(texels, (vec2(pixel) + 0.5) * step)
#endif
