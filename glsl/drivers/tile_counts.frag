#version 330 core
// Counts, for each tile and each kernel, the rays of the tile that wait for the kernel. The host then omits
// tiles without waiting rays: a software renderer lacks the hierarchical depth buffer with which the cards
// of 2002-2006 skipped such tiles.

#include <streams>

uniform ivec2 size;   // rays

out vec4 waiting;     // number of rays that wait for kernels 1 to 4

void main() {
    ivec2 lo = TILE * ivec2(gl_FragCoord.xy);
    ivec2 hi = min(lo + TILE, size);
    waiting = vec4(0.0);
    for (int y = lo.y; y < hi.y; ++y) {
        for (int x = lo.x; x < hi.x; ++x) {
            int phase = state_load(ivec2(x, y)).phase;
            waiting += vec4(equal(ivec4(phase), ivec4(1, 2, 3, 4)));
        }
    }
}
