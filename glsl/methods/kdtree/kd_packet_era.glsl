// kd-packet in the era form (docs/era.md): the kernels of kd_packet.glsl as Horn et al. 2007 may have
// written them for a card with branches. A packet is 2x2 rays. A vector of four components holds one number
// per ray, so that one instruction of the card serves four rays.
//
// The loop of era/packet_loop.glsl branches to the kernels:
//   `begin` begins the next turn: a walk from the root, of rays whose directions agree in their signs.
//   `traverse` visits a node. `push` follows if rays need both children.
//   `intersect` tests a triangle against the four rays.
//   `leave` ends a leaf's visit. `pop` follows if a ray still searches. An empty stack means a restart.
//
// Empty leaves are visited, because the survey does not say that Horn et al. skipped them. Boxes are not
// widened. The cursor in a leaf's list and the node share a field of the state. The node of a free stack
// entry is 0. A restart begins at the node `pushed`. With PUSH_DOWN, `pushed` is the packet's current node
// until rays need both children. Until then, the node of the stack's first entry is PUSHING.

#define node place      // in a leaf, this field holds the cursor
#define cursor place

#include "core/axis.glsl"

const float NEVER = 3.0e38;    // t_min of a ray that waits for its turn or is settled
const float FREE = 0.0;
const float PUSHING = -1.0;
const vec4 ZERO = vec4(0.0);

// Choose for each ray: the component of `a` where `is_a` is true, else the component of `b`.
vec4 each_chosen(bvec4 is_a, vec4 a, vec4 b) {
    return vec4(is_a.x ? a.x : b.x, is_a.y ? a.y : b.y, is_a.z ? a.z : b.z, is_a.w ? a.w : b.w);
}

// 1 for each ray that waits for its turn, else 0. A shadow ray does not wait if it has a hit.
vec4 waiting(State state, Hit hit) {
    vec4 waits = vec4(lessThan(state.t_turn, vec4(NEVER)));
#ifdef ANY_HIT
    waits *= vec4(equal(hit.triangle, vec4(NO_TRIANGLE)));
#endif
    return waits;
}

void init(Packet_rays rays, out State state) {
    vec4 x_lo = (scene_lo.x - rays.origin_x) * rays.inverse_x;
    vec4 y_lo = (scene_lo.y - rays.origin_y) * rays.inverse_y;
    vec4 z_lo = (scene_lo.z - rays.origin_z) * rays.inverse_z;
    vec4 x_hi = (scene_hi.x - rays.origin_x) * rays.inverse_x;
    vec4 y_hi = (scene_hi.y - rays.origin_y) * rays.inverse_y;
    vec4 z_hi = (scene_hi.z - rays.origin_z) * rays.inverse_z;
    vec4 entry = max(max(min(x_lo, x_hi), min(y_lo, y_hi)), min(z_lo, z_hi));
    vec4 leaves = min(min(max(x_lo, x_hi), max(y_lo, y_hi)), max(z_lo, z_hi));
    vec4 start = max(entry, rays.t_min);
    state.t_exit = min(leaves, rays.t_max);
    state.t_turn = each_chosen(lessThanEqual(start, state.t_exit), start, vec4(NEVER));
    state.t_min = vec4(NEVER);
    state.t_max = ZERO;
    state.phase = dot(vec4(lessThan(state.t_turn, vec4(NEVER))), vec4(1.0)) > 0.0 ? BEGIN : DONE;
}

void begin(Packet_rays rays, inout State state, inout Hit hit) {
    vec4 waits = waiting(state, hit);
    vec4 first = waits * vec4(1.0, 1.0 - waits.x, 1.0 - max(waits.x, waits.y),
                              1.0 - max(max(waits.x, waits.y), waits.z));
    vec4 x = vec4(lessThan(rays.inverse_x, ZERO));
    vec4 y = vec4(lessThan(rays.inverse_y, ZERO));
    vec4 z = vec4(lessThan(rays.inverse_z, ZERO));
    state.negative = vec3(dot(first, x), dot(first, y), dot(first, z));
    vec4 differs = abs(x - state.negative.x) + abs(y - state.negative.y) + abs(z - state.negative.z);
    bvec4 comes = greaterThan(waits, differs);
    state.t_min = each_chosen(comes, state.t_turn, state.t_min);
    state.t_turn = each_chosen(comes, vec4(NEVER), state.t_turn);
    state.t_max = state.t_exit;
    state.node = 0.0;
    state.pushed = 0.0;
    state.node_0 = PUSHING;
    state.node_1 = FREE;
    state.node_2 = FREE;
    state.phase = TRAVERSE;
}

// Move on to the near child if any ray needs it, else to the far child. `far`: the node to push, or 0.
void traverse(Packet_rays rays, inout State state, inout Hit hit) {
    float axis = kd_node_axis(state.node);
    float left = kd_node_left(state.node);
    state.far = FREE;
    if (axis >= LEAF) {
        state.end = left + kd_node_count(state.node);
        state.phase = left < state.end ? INTERSECT : LEAVE;
        state.cursor = left;
    } else {
        float plane = kd_node_split(state.node);
        vec4 start = axis == 0.0 ? rays.origin_x : (axis == 1.0 ? rays.origin_y : rays.origin_z);
        vec4 inverse = axis == 0.0 ? rays.inverse_x : (axis == 1.0 ? rays.inverse_y : rays.inverse_z);
        vec4 t_split = (plane - start) * inverse;
        vec4 t_near = min(t_split, state.t_max);
        bool any_near = any(lessThan(state.t_min, t_near));
        bool any_far = any(lessThan(max(state.t_min, t_split), state.t_max));
        float behind = along(axis, state.negative);
        float near = left + behind;
        float far = left + 1.0 - behind;
        state.t_far = state.t_max;
        state.t_max = any_near ? t_near : state.t_max;
        state.node = any_near ? near : far;
        state.phase = any_near || any_far ? TRAVERSE : LEAVE;
        if (any_near && any_far) {
            state.far = far;
            state.node_0 = max(state.node_0, FREE);
        }
#ifdef PUSH_DOWN
        state.pushed = state.node_0 == PUSHING ? state.node : state.pushed;
#endif
    }
}

// A full stack drops its lowest entry.
void push(Packet_rays rays, inout State state, inout Hit hit) {
    state.node_2 = STACK_SIZE > 2 ? state.node_1 : FREE;
    state.node_1 = STACK_SIZE > 1 ? state.node_0 : FREE;
    state.node_0 = state.far;
    state.t_max_2 = state.t_max_1;
    state.t_max_1 = state.t_max_0;
    state.t_max_0 = state.t_far;
}

// Test a triangle with all rays, also waiting rays (Moeller and Trumbore 1997; core/moller_trumbore.glsl).
void intersect(Packet_rays rays, inout State state, inout Hit hit) {
    float i = reference_triangle(state.cursor);
    vec3 v0 = triangle_v0(i);
    vec3 e1 = triangle_v1(i) - v0;
    vec3 e2 = triangle_v2(i) - v0;
    vec4 p_x = rays.direction_y * e2.z - rays.direction_z * e2.y;
    vec4 p_y = rays.direction_z * e2.x - rays.direction_x * e2.z;
    vec4 p_z = rays.direction_x * e2.y - rays.direction_y * e2.x;
    vec4 det = e1.x * p_x + e1.y * p_y + e1.z * p_z;
    vec4 inverse = 1.0 / det;
    vec4 s_x = rays.origin_x - v0.x;
    vec4 s_y = rays.origin_y - v0.y;
    vec4 s_z = rays.origin_z - v0.z;
    vec4 u = (s_x * p_x + s_y * p_y + s_z * p_z) * inverse;
    vec4 q_x = s_y * e1.z - s_z * e1.y;
    vec4 q_y = s_z * e1.x - s_x * e1.z;
    vec4 q_z = s_x * e1.y - s_y * e1.x;
    vec4 v = (rays.direction_x * q_x + rays.direction_y * q_y + rays.direction_z * q_z) * inverse;
    vec4 t = (e2.x * q_x + e2.y * q_y + e2.z * q_z) * inverse;
    vec4 inside = min(min(u, v), 1.0 - (u + v));
    vec4 found = vec4(greaterThanEqual(inside, ZERO)) * vec4(greaterThanEqual(t, rays.t_min))
        * vec4(lessThan(t, hit.t)) * vec4(notEqual(det, ZERO));
    bvec4 nearer = greaterThan(found, ZERO);
    hit.t = each_chosen(nearer, t, hit.t);
    hit.u = each_chosen(nearer, u, hit.u);
    hit.v = each_chosen(nearer, v, hit.v);
    hit.triangle = each_chosen(nearer, vec4(triangle_index(i)), hit.triangle);
    state.cursor += 1.0;
    state.phase = state.cursor < state.end ? INTERSECT : LEAVE;
}

// Settle a ray that has a hit before the leaf's end, or whose interval ends with the leaf. Every other ray
// continues at the leaf's end.
void leave(Packet_rays rays, inout State state, inout Hit hit) {
    vec4 after = each_chosen(lessThan(hit.t, state.t_max), vec4(NEVER), state.t_max);
    state.t_min = each_chosen(lessThan(state.t_min, state.t_max), after, state.t_min);
#ifdef ANY_HIT
    state.t_min = each_chosen(equal(hit.triangle, vec4(NO_TRIANGLE)), state.t_min, vec4(NEVER));
#endif
    state.phase = any(lessThan(state.t_min, state.t_exit)) ? POP
        : any(greaterThan(waiting(state, hit), ZERO)) ? BEGIN : DONE;
}

void restart(inout State state) {
    state.node = state.pushed;
    state.t_max = state.t_exit;
    state.node_0 = PUSHING;
    state.phase = TRAVERSE;
}

// If no ray's interval meets the popped node, the phase stays POP.
void pop(Packet_rays rays, inout State state, inout Hit hit) {
#if STACK_SIZE > 0
    if (state.node_0 > FREE) {
        state.node = state.node_0;
        state.t_max = state.t_max_0;
        state.phase = any(lessThan(state.t_min, state.t_max)) ? TRAVERSE : POP;
        state.node_0 = state.node_1;
        state.node_1 = state.node_2;
        state.node_2 = FREE;
        state.t_max_0 = state.t_max_1;
        state.t_max_1 = state.t_max_2;
    } else {
        restart(state);
    }
#else
    restart(state);
#endif
}
