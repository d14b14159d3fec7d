#version 330 core
// Defines the names of card.frag for this project's renderer, whose context does not accept GLSL 1.20. With
// either file, the same text of a kernel compiles.

#define texel_of(texels) texture(texels, gl_FragCoord.xy / vec2(textureSize(texels, 0)))
#define texel_at(texels, place) texture(texels, place)
#define TARGET(k) target_##k

layout(location = 0) out vec4 target_0;
layout(location = 1) out vec4 target_1;
layout(location = 2) out vec4 target_2;
layout(location = 3) out vec4 target_3;

#include <pass>
