// The turns of a packet. A walk visits nodes in one order, but rays whose directions differ in a sign need
// different orders. So a packet may walk several times. Each walk is a turn: it includes the waiting rays
// whose directions have the signs of the first waiting ray's direction.

#include "core/octant.glsl"

// The axes along which the directions of an octant are negative.
bvec3 negative_axes(int octant) {
    return bvec3((octant & 1) != 0, (octant & 2) != 0, (octant & 4) != 0);
}

const float NEVER = 3.0e38;   // t_min of a ray outside the current walk: it waits, or its search is over

float t_turn[RAYS];           // t_min of a ray that waits for its turn, else NEVER
int octant[RAYS];             // the number of the ray's turn
int turn;                     // the number of the current turn: in a tree, bit a is set if the
                              // directions are negative along axis a. If the rays of a turn also
                              // share a dominant axis, 8 times that axis is added. The grid's
                              // turns are numbered by `major_of` (methods/grid/coherent_grid.glsl).

// The octant of a ray's direction. Without OCTANTS and INTERVAL_TEST, nothing in a walk depends on the
// signs of directions. Then return 0 for every ray, so that all rays walk together.
int octant_of(Ray ray) {
#if defined(OCTANTS) || defined(INTERVAL_TEST)
    return direction_octant(ray.direction);
#else
    return 0;
#endif
}

void find_turn(int r) {
    turn = turn < 0 && t_turn[r] != NEVER ? octant[r] : turn;
}

// Choose the turn of the first ray that waits. Return false when no ray waits.
bool rays_wait() {
    turn = -1;
    EACH(find_turn)
    return turn >= 0;
}
