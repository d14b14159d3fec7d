// Projects everything inside a sphere along parallel lines. The depth is 0 at the near end of the sphere.

uniform vec3 centre;
uniform float reach;        // the sphere's radius
uniform vec3 across;        // unit axes of the image
uniform vec3 upward;
uniform vec3 along;         // away from the viewer
uniform float pixel_size;   // world units
uniform vec2 shift;         // shift in pixels, so that the grids of different directions do not coincide
uniform float resolution;   // pixels per side

// Return x and y of a point in pixels, and its depth in world units.
vec3 projected(vec3 place) {
    vec3 p = place - centre;
    return vec3(vec2(dot(p, across), dot(p, upward)) / pixel_size + 0.5 * resolution + shift,
                dot(p, along) + reach);
}
