// Light sampling of the surroundings. In an image, brighter directions are sampled more often. Multiple
// importance sampling weights the samples, as for emitting triangles. A sky varies little in brightness, so
// light sampling draws a direction as the path's continuation does. The density of light sampling is then
// the density of the continuation times `far_chance`.
// Include after scatter.glsl, surroundings.glsl, luminance.glsl and both_ways.glsl.

uniform int far_light;      // the surroundings' number among the lights
uniform float far_chance;   // the probability that light sampling chooses the surroundings

#ifdef ASKED_IMAGE
#include "render/image_light.glsl"
#endif

// Sample a direction towards the surroundings. Return how much light from this direction the surface
// reflects back along the ray, if no triangle is in between.
vec3 surroundings_asked(Surface surface, Scatter scatter, vec4 random, out vec3 direction) {
#ifdef ASKED_IMAGE
    if (surroundings_kind == IMAGE_KIND) {
        FarLight light = ask_image(random.zw);
        direction = stored(normalize(light.direction));
        float density;
        vec3 reflected = scattered(surface, scatter, direction, density);
        float across = length(light.direction.xz);
        return reflected * light.radiance
            * (across * power_weight(light.bright, across * density));
    }
#endif
    Onward next = onward(surface, scatter, random);
    direction = stored(normalize(next.direction));
    return next.density > 0.0 ? next.weight * surroundings(direction) / (1.0 + far_chance)
                              : vec3(0.0);
}

// The weight of the surroundings' light for a path that leaves the scene. `density` is the density with
// which the path drew its direction; 0 for an eye ray and after a mirror or a dielectric.
float surroundings_share(vec3 direction, vec3 radiance, float density) {
    if (density == 0.0 || far_chance == 0.0) {
        return 1.0;
    }
#ifdef ASKED_IMAGE
    if (surroundings_kind == IMAGE_KIND) {
        float found = density * length(direction.xz);
        float bright = image_bright(direction, radiance);
        return bright > 0.0 ? found * power_weight(found, bright) : 1.0;
    }
#endif
    return 1.0 / (1.0 + far_chance);
}
