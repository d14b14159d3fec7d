#version 300 es
// Counts the rays of a square of 16 x 16 that still wait for a kernel, and finds their largest number of steps.
// WebGL 2 has no query that counts fragments, so the player reads these few texels back.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D phases;
uniform sampler2D counts;
uniform ivec2 places;           // components of the phase and of the steps

out vec4 found;

void main() {
    ivec2 lo = 16 * ivec2(gl_FragCoord.xy);
    ivec2 hi = min(lo + 16, textureSize(phases, 0));
    found = vec4(0.0);
    for (int y = lo.y; y < hi.y; ++y) {
        for (int x = lo.x; x < hi.x; ++x) {
            found.x += texelFetch(phases, ivec2(x, y), 0)[places.x] > 0.0 ? 1.0 : 0.0;
            found.y = max(found.y, texelFetch(counts, ivec2(x, y), 0)[places.y]);
        }
    }
}
