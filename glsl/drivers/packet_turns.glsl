// Turns. A walk has one order of nodes, and rays whose directions differ in a sign need different orders.
// The rays that agree with the first unsettled ray walk together. All other rays wait for a later turn.

#include "core/octant.glsl"

const float NEVER = 3.0e38;   // t_min of a ray that waits or is settled

float t_turn[RAYS];           // t_min of a ray that waits for its turn, else NEVER
int octant[RAYS];             // the octant of the ray, and with it the ray's turn
int turn;                     // the current turn. Bit a is set where axis a is negative; where the rays
                              // share a dominant axis as well, that axis times 8 is added.

// The octant of a ray's direction. If neither the order of nodes nor a bound depends on signs, all rays
// have octant 0 and walk together.
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

// Choose the turn of the first ray that waits. False when no ray waits.
bool rays_wait() {
    turn = -1;
    EACH(find_turn)
    return turn >= 0;
}
