#version 330 core
// Shows the hits in the browser: the surfaces lit from the eye, or the steps of each ray. With
// surfaces, an unfinished ray has the colour of its phase, the kernel for which the ray waits.

uniform sampler2D hits;         // t, u, v, triangle
uniform sampler2D surfaces;     // normal, and 8 bits each of red, green and blue as one number
uniform sampler2D directions;
uniform sampler2D phases;       // the texture that holds the phase of each state
uniform sampler2D counts;       // the texture that holds the number of steps of each state
uniform ivec2 places;           // components that hold the phase and the steps
uniform float most;             // the number of steps that gets the brightest colour; 0: show surfaces
uniform bool stepwise;          // whether the rays have a phase and a number of steps
uniform vec2 size;              // size of the shown picture, in pixels
uniform vec3 kernel_colours[4]; // colours of rays in phase 1, 2, 3, and 4 or more, as the screen shows them
uniform vec3 heat_colours[HEAT_COLOURS];    // from no step to `most` steps, as the screen shows them

out vec4 colour;

vec3 heat(float x) {
    float at = clamp(x, 0.0, 1.0) * float(HEAT_COLOURS - 1);
    int low = min(int(at), HEAT_COLOURS - 2);
    return mix(heat_colours[low], heat_colours[low + 1], at - float(low));
}

vec3 sky(vec3 direction) {
    return mix(vec3(0.86, 0.9, 0.95), vec3(0.55, 0.66, 0.8), normalize(direction).y);
}

vec3 surface(int triangle, vec3 direction) {
    int width = textureSize(surfaces, 0).x;
    vec4 texel = texelFetch(surfaces, ivec2(triangle % width, triangle / width), 0);
    int packed = int(texel.w);
    vec3 reflectance = vec3(packed & 255, (packed >> 8) & 255, packed >> 16) / 255.0;
    return reflectance * (0.15 + 0.85 * abs(dot(texel.xyz, normalize(direction))));
}

void main() {
    ivec2 rays = textureSize(hits, 0);
    ivec2 pixel = clamp(ivec2(gl_FragCoord.xy / size * vec2(rays)), ivec2(0), rays - 1);
    pixel.y = rays.y - 1 - pixel.y;
    vec4 hit = texelFetch(hits, pixel, 0);
    vec3 direction = texelFetch(directions, pixel, 0).xyz;
    ivec2 place = pixel * textureSize(phases, 0) / rays;    // a packet has one state for all its rays
    int phase = stepwise ? int(texelFetch(phases, place, 0)[places.x]) : 0;
    vec3 shown = sqrt(int(hit.w) == NO_TRIANGLE ? sky(direction) : surface(int(hit.w), direction));
    if (most > 0.0) {
        shown = heat(texelFetch(counts, place, 0)[places.y] / most);
    } else if (phase > 0) {
        shown = kernel_colours[min(phase, 4) - 1];
    }
    if (hit.w < 0.0) {
        shown = vec3(0.7, 0.0, 0.63);   // no fragment wrote this hit
    }
    colour = vec4(shown, 1.0);
}
