#version 120
// The dialect of the cards of 2002-2006, GLSL 1.20, without integers. A fragment reads its ray's texels at
// interpolated texture coordinates. renderer.frag defines the same names for this project's renderer.

varying vec2 here;     // texture coordinates of the fragment's ray in every stream

#define texel_of(texels) texture2D(texels, here)
#define texel_at(texels, place) texture2D(texels, place)
#define TARGET(k) gl_FragData[k]

#include <pass>
