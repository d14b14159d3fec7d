#version 330 core
// Counts the waiting rays of a square of TILE x TILE rays by phase (the kernel for which a ray waits).
// Finds the largest number of steps of a ray in the square. WebGL 2 has no query that counts fragments, so
// the player (the JavaScript program that runs the passes) reads these texels back.

uniform sampler2D phases;
uniform sampler2D counts;
uniform ivec2 places;           // components that hold the phase and the steps

layout(location = 0) out vec4 waiting;      // the rays in phase 1, 2, 3, and 4 or more
layout(location = 1) out vec4 most;

void main() {
    ivec2 lo = TILE * ivec2(gl_FragCoord.xy);
    ivec2 hi = min(lo + TILE, textureSize(phases, 0));
    waiting = most = vec4(0.0);
    for (int y = lo.y; y < hi.y; ++y) {
        for (int x = lo.x; x < hi.x; ++x) {
            int phase = int(texelFetch(phases, ivec2(x, y), 0)[places.x]);
            waiting += vec4(phase == 1, phase == 2, phase == 3, phase > 3);
            most = max(most, vec4(texelFetch(counts, ivec2(x, y), 0)[places.y]));
        }
    }
}
