// Multiple importance sampling by the power heuristic with exponent 2 (Veach and Guibas 1995): weighs two
// strategies that can find the same light by their densities. The twin: `_power_weight` of
// gpgpu_rt/reference/path.py.

// The weight of the strategy with density ``mine``, divided by that density. Zero where the strategy never
// samples the direction.
float power_weight(float mine, float other) {
    float most = max(mine, other);
    vec2 part = vec2(mine, other) / most;
    return mine > 0.0 ? part.x / (dot(part, part) * most) : 0.0;
}
