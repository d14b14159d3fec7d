// Computes light from the scene's surroundings: the radiance of a ray that misses everything, and the light
// that reaches a surface, without shadows. `ambient_light` is the ambient term of Whitted's model ("An
// Improved Illumination Model for Shaded Display", 1980). The formulas equal those of
// gpgpu_rt/scene/light.py. Include this file after surface.glsl, which includes texture.glsl.

const int BACKDROP_KIND = 0;
const int SKY_KIND = 1;
const int IMAGE_KIND = 2;

#if defined(BACKDROP) && (defined(SKY) || defined(SKY_IMAGE)) || defined(SKY) && defined(SKY_IMAGE)
uniform int surroundings_kind;
#elif defined(BACKDROP)
const int surroundings_kind = BACKDROP_KIND;
#elif defined(SKY)
const int surroundings_kind = SKY_KIND;
#else
const int surroundings_kind = IMAGE_KIND;
#endif

uniform vec3 zenith;                // radiance from straight above
uniform vec3 ground;                // radiance from straight below
uniform vec3 ambient_terms[4];      // a constant term, and factors of the normal's x, y and z

#ifdef SKY_IMAGE
#include "render/angle.glsl"

uniform sampler2D surroundings_image;

// Texture coordinates of the image: longitude and latitude.
vec2 surroundings_uv(vec3 direction) {
    return 0.5 + vec2(angle_of(vec2(-direction.z, direction.x)) * 0.15915494,
                      angle_of(vec2(length(direction.xz), direction.y)) * 0.31830989);
}
#endif

vec3 surroundings(vec3 direction) {
    vec3 light = vec3(0.0);
#ifdef BACKDROP
    if (surroundings_kind == BACKDROP_KIND) {
        light = mix(vec3(0.86, 0.88, 0.90), vec3(0.42, 0.55, 0.72),
                    smoothstep(-0.3, 0.9, direction.y));
    }
#endif
#ifdef SKY
    if (surroundings_kind == SKY_KIND) {
        light = mix(ground, zenith, 0.5 + 0.5 * direction.y);
    }
#endif
#ifdef SKY_IMAGE
    if (surroundings_kind == IMAGE_KIND) {
        ivec2 size = textureSize(surroundings_image, 0);
        float margin = 0.5 / float(size.y);   // keeps the filter from blending the two poles
        vec2 uv = surroundings_uv(direction);
        light = image_at(surroundings_image, ivec2(0), size,
                         vec2(uv.x, clamp(uv.y, margin, 1.0 - margin)));
    }
#endif
    return light;
}

// The light that a white surface reflects from the surroundings. The formula for the backdrop also depends
// on the direction of view.
vec3 ambient_light(vec3 normal, vec3 direction) {
    vec3 light = vec3(0.0);
#ifdef BACKDROP
    if (surroundings_kind == BACKDROP_KIND) {
        light = mix(vec3(0.16, 0.14, 0.12), vec3(0.26, 0.29, 0.33), 0.5 + 0.5 * normal.y)
              * (0.7 + 0.3 * max(dot(normal, -direction), 0.0));
    }
#endif
#if defined(SKY) || defined(SKY_IMAGE)
    if (surroundings_kind != BACKDROP_KIND) {
        light = max(ambient_terms[0] + normal.x * ambient_terms[1] + normal.y * ambient_terms[2]
                    + normal.z * ambient_terms[3], 0.0);
    }
#endif
    return light;
}
