#version 330 core
// Each fragment finds whether one tile of pixels holds a live path.

#include <streams>

uniform ivec2 size;   // pixels

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * TILE;
    ivec2 end = min(corner + TILE, size);
    vec3 most = vec3(0.0);
    for (int y = corner.y; y < end.y; ++y) {
        for (int x = corner.x; x < end.x; ++x) {
            most = max(most, path_load(ivec2(x, y)).weight);
        }
    }
    live_store(Live(max(max(most.r, most.g), most.b)));
}
