// Multiple importance sampling by the power heuristic with exponent 2 (Veach and Guibas 1995): combines two
// strategies that can find the same light. `_power_weight` of gpgpu_rt/reference/path.py is the float64
// version.

// The weight of the strategy with density ``mine``, divided by that density; zero if the density is zero.
float power_weight(float mine, float other) {
    float most = max(mine, other);
    vec2 part = vec2(mine, other) / most;
    return mine > 0.0 ? part.x / (dot(part, part) * most) : 0.0;
}
