// Turns: rays of a packet whose directions differ in a sign would need another order of nodes. They
// wait until the rays that agree with the first unsettled one are through.

#include "core/octant.glsl"

const float NEVER = 3.0e38;   // t_min of a ray that waits or is settled

float t_turn[RAYS];           // t_min of a ray whose turn has not come, else NEVER
int octant[RAYS];
int turn;                     // the octant whose turn it is: bit a is set where axis a is negative
                              // and the dominant axis, times 8, where rays share that as well

int shared_axis(Ray ray) {
#ifdef SHARED_AXES
    return ray.dominant.x ? 0 : ray.dominant.y ? 8 : 16;
#else
    return 0;
#endif
}

// Rays go together whatever their signs where no order of nodes is a direction's, and no bound.
int octant_of(Ray ray) {
    int found = 0;
#if defined(OCTANTS) || defined(INTERVAL_TEST)
    found = direction_octant(ray.direction);
#endif
    return found + shared_axis(ray);
}

void find_turn(int r) {
    turn = turn < 0 && t_turn[r] != NEVER ? octant[r] : turn;
}

// Whose turn it is: that of the first ray that waits; false when none does.
bool rays_wait() {
    turn = -1;
    EACH(find_turn)
    return turn >= 0;
}
