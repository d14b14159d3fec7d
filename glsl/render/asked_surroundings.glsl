// What surrounds the scene as a light that paths ask: an image by how bright it is, which counts as
// triangles that emit do; a sky, which is even, by a second direction of those that the surface may
// send a path to: both are as good, and count by how often they are drawn. Comes after scatter.glsl,
// surroundings.glsl, luminance.glsl and both_ways.glsl.

uniform int far_light;      // its number among lights
uniform float far_chance;   // that it is the one asked

#ifdef ASKED_IMAGE
#include "render/image_light.glsl"
#endif

// What of it leaves a surface along the ray unless something is between, and from which direction.
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

// Of a path that leaves the scene: how much what it meets counts, by the density of its direction.
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
