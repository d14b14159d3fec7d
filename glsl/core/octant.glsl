// The octant of a direction: bit a is set where the direction's component along axis a is negative.

int direction_octant(vec3 direction) {
    ivec3 negative = ivec3(lessThan(direction, vec3(0.0)));
    return negative.x + 2 * negative.y + 4 * negative.z;
}

bvec3 negative_axes(int octant) {
    return bvec3((octant & 1) != 0, (octant & 2) != 0, (octant & 4) != 0);
}
