// The octant of a direction: bit a is set where the direction's component along axis a is negative.

int direction_octant(vec3 direction) {
    ivec3 negative = ivec3(lessThan(direction, vec3(0.0)));
    return negative.x + 2 * negative.y + 4 * negative.z;
}
