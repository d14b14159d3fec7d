// Moves two waves, up to 0.15 units high, across a surface.

vec3 deform(vec3 rest, float time) {
    float lift = 0.1 * sin(4.0 * rest.x + 3.0 * time) + 0.05 * sin(7.0 * rest.z - 5.0 * time);
    return rest + vec3(0.0, lift, 0.0);
}
