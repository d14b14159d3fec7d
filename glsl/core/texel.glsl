// TEXEL(texels, step, pixel) is a texel of a texture, `step` the distance of its texels. It samples: what
// is read here has one level and no filter, and a texel's middle, rounded, lies within it, so that this is
// the same texel in any control flow. llvmpipe asks texelFetch for each lane's level and its size, at
// twice the instructions. With TEXEL_FETCH (period hardware's cost model) the fetch is what it says.

#ifdef TEXEL_FETCH
#define TEXEL(texels, step, pixel) texelFetch(texels, pixel, 0)
#else
#define TEXEL(texels, step, pixel) texture(texels, (vec2(pixel) + 0.5) * step)
#endif
