// Light that can be found in two ways counts by how likely each was to find it there: the power
// heuristic, exponent 2 (Veach and Guibas 1995). The twin: `_power_weight` of
// gpgpu_rt/reference/path.py.

// Of one way, whose density is ``mine``: the share that it counts, over that density. Zero where it
// would never come there.
float power_weight(float mine, float other) {
    float most = max(mine, other);
    vec2 part = vec2(mine, other) / most;
    return mine > 0.0 ? part.x / (dot(part, part) * most) : 0.0;
}
