// A ray of the era form (docs/era.md). This file replaces core/ray.glsl. No component of a direction is
// zero (era/rays.frag), so the inverse is finite. A loop computes the inverse once, before its kernels. So
// with IN_LOOP, a kernel reads it from a texture.

uniform vec3 scene_lo;
uniform vec3 scene_hi;

// Boxes are not widened: their corners are measured from the origin itself.
#define lo_origin origin
#define hi_origin origin

struct Ray {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max;
    vec3 inv_dir;
};

#ifdef IN_LOOP
uniform sampler2D inverse_texel_0;
Ray ray_setup(Rays texels) {
    return Ray(texels.origin, texels.t_min, texels.direction, texels.t_max, texel_of(inverse_texel_0).xyz);
}
#else
Ray ray_setup(Rays texels) {
    return Ray(texels.origin, texels.t_min, texels.direction, texels.t_max, R(1.0 / texels.direction));
}
#endif
