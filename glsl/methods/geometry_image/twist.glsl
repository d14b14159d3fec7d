// Twists a surface about the y axis, back and forth, by an angle that grows with height.

vec3 deform(vec3 rest, float time) {
    float angle = sin(time) * rest.y;
    vec2 way = vec2(cos(angle), sin(angle));
    return vec3(way.x * rest.x - way.y * rest.z, rest.y, way.y * rest.x + way.x * rest.z);
}
