#version 330 core
// Finds the cheapest split of a large node (large.glsl) along one axis. Writes the split's cost, the left
// child's last bin, and the left child's number of triangles.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/sah.glsl"

void main() {
    int first = BINS * element();
    float right_area[BINS], right_count[BINS];
    vec3 lo = vec3(FAR), hi = vec3(-FAR);
    float count = 0.0;
    for (int b = BINS - 1; b >= 0; --b) {
        Bin bin = bin_load(table_texel(first + b));
        lo = min(lo, bin.lo);
        hi = max(hi, -bin.minus_hi);
        count += float(bin.count);
        right_area[b] = half_area(lo, hi);
        right_count[b] = count;
    }
    vec4 best = vec4(FAR, -1.0, 0.0, 0.0);
    lo = vec3(FAR);
    hi = vec3(-FAR);
    for (int b = 0; b < BINS - 1; ++b) {
        Bin bin = bin_load(table_texel(first + b));
        lo = min(lo, bin.lo);
        hi = max(hi, -bin.minus_hi);
        float taken = right_count[0] - right_count[b + 1];
        float cost = split_cost(half_area(lo, hi), taken, right_area[b + 1], right_count[b + 1],
                                right_area[0]);
        if (taken > 0.0 && right_count[b + 1] > 0.0 && cost < best.x) {
            best = vec4(cost, b, taken, 0.0);
        }
    }
    costs_store(Costs(best));
}
