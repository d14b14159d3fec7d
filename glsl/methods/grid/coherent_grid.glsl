// Coherent grid traversal: Wald, Ize, Kensler, Knoll, Parker, "Ray Tracing Animated Scenes using Coherent
// Grid Traversal", SIGGRAPH 2006. The rays of a packet walk the grid of grid.glsl together, slice by slice
// along their dominant axis. In each slice the rays span a rectangle of cells. All rays test the triangles
// of all these cells. With the watertight test, triangles outside the packet's frustum are skipped
// (vertex_culling.glsl).
//
// Departures: the paper moves four bounding planes from slice to slice by four additions. Here each slice
// computes its rectangle anew from the intervals that the rays still search. This costs more than the
// additions, but less than the visits of unneeded cells that it avoids. Rays whose hit lies before the
// slice, or that begin in a later slice, do not widen the rectangle. There are no mailboxes: a triangle in
// several cells is tested in each cell. Rays with another dominant axis, or another sign along this axis,
// wait for a later turn (drivers/packet_turns.glsl).

#include "drivers/packet_turns.glsl"

uniform ivec3 grid_resolution;
uniform vec3 cell_size;

bool through = false;   // whether the walk of the current turn has ended
float t_exit[RAYS];
float t_enter[RAYS];

// Values of the current turn. Axes are permuted as in the watertight test: the dominant axis comes last.
bvec2 major;
bool forward;
vec3 grid_lo;
vec3 size;
ivec3 resolution;
ivec3 strides;

int slice;
ivec2 first_cell;       // the first and the last cell of the current slice's rectangle
ivec2 last_cell;
ivec2 cell;             // the next cell to visit; cell.y > last_cell.y when the rectangle is finished

#define PRESENT(r) (rays[r].t_min < NEVER)
#include <culling>

bool is_settled(int r) {
    return t_turn[r] == NEVER && (through || rays[r].t_min == NEVER);
}

// Turns ------------------------------------------------------------------------------------------

// The number of a ray's turn: twice the dominant axis, plus 1 if the direction is negative along this axis.
int major_of(Ray ray) {
    int axis = ray.dominant.x ? 0 : ray.dominant.y ? 1 : 2;
    return 2 * axis + (permute(ray, ray.inv_dir).z < 0.0 ? 1 : 0);
}

void start_ray(int r) {
    Ray ray = rays[r];
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    t_enter[r] = max(interval.x, ray.t_min);
    t_exit[r] = min(interval.y, ray.t_max);
    octant[r] = major_of(ray);
    t_turn[r] = t_enter[r] <= t_exit[r] && ray.t_min <= ray.t_max ? ray.t_min : NEVER;
    rays[r].t_min = NEVER;
}

void start_packet() {
    EACH(start_ray)
}

float start;            // coordinate along the dominant axis at which the earliest ray begins

void take_turn(int r) {
    bool comes = octant[r] == turn;
    rays[r].t_min = comes ? t_turn[r] : through ? NEVER : rays[r].t_min;
    t_turn[r] = comes ? NEVER : t_turn[r];
    float along = permuted(major, rays[r].direction).z;
    float origin = permuted(major, forward ? rays[r].hi_origin : rays[r].lo_origin).z;
    float at = R(origin + R(t_enter[r] * along));
    start = rays[r].t_min == NEVER ? start : forward ? min(start, at) : max(start, at);
}

ivec3 permuted_cells(ivec3 v) {
    return major.x ? v.yzx : (major.y ? v.zxy : v);
}

// Begin a turn just before the first slice.
void begin_turn() {
    major = bvec2(turn < 2, turn < 4);
    forward = turn % 2 == 0;
    start = forward ? NEVER : -NEVER;
    EACH(take_turn)
    bound_frustum();
    grid_lo = permuted(major, scene_lo);
    size = permuted(major, cell_size);
    resolution = permuted_cells(grid_resolution);
    strides = permuted_cells(ivec3(1, grid_resolution.x, grid_resolution.x * grid_resolution.y));
    float place = R(R(start - grid_lo.z) / size.z);
    slice = int(clamp(floor(place), 0.0, float(resolution.z - 1))) - (forward ? 1 : -1);
    cell = ivec2(0);
    last_cell = ivec2(-1);
    through = false;
}

// Slices -----------------------------------------------------------------------------------------

float near_plane;
float far_plane;
bool any_ahead;         // whether any ray still searches this slice or a later slice
vec2 lo;
vec2 hi;

// Extend the rectangle by the ray's remaining interval in the slice, slightly widened (core/slack.glsl).
void cross_slice(int r) {
    Ray ray = rays[r];
    float inv = permuted(major, ray.inv_dir).z;
    vec3 lower = permuted(major, ray.hi_origin);
    vec3 upper = permuted(major, ray.lo_origin);
    float t_near = R(R(near_plane - (forward ? upper.z : lower.z)) * inv);
    float t_far = R(R(far_plane - (forward ? lower.z : upper.z)) * inv);
    float t_end = min(t_exit[r], hits[r].t);
    bool ahead = ray.t_min < NEVER && t_near <= t_end;
    any_ahead = any_ahead || ahead;
    float begin = max(t_near, t_enter[r]);
    float end = min(t_far, t_end);
    vec2 direction = permuted(major, ray.direction).xy;
    vec2 from = R(begin * direction);
    vec2 to = R(end * direction);
    bool here = ahead && begin <= end;
    lo = here ? min(lo, R(lower.xy + min(from, to))) : lo;
    hi = here ? max(hi, R(upper.xy + max(from, to))) : hi;
}

// Advance to the next slice. Return false after the last slice that a ray searches.
bool enter_slice() {
    ++steps;
    slice += forward ? 1 : -1;
    near_plane = R(grid_lo.z + R(float(slice + (forward ? 0 : 1)) * size.z));
    far_plane = R(grid_lo.z + R(float(slice + (forward ? 1 : 0)) * size.z));
    any_ahead = false;
    lo = vec2(NEVER);
    hi = vec2(-NEVER);
    EACH(cross_slice)
    vec2 most = vec2(resolution.xy - 1);
    first_cell = ivec2(clamp(floor(R(R(lo - grid_lo.xy) / size.xy)), vec2(0.0), most));
    last_cell = ivec2(clamp(floor(R(R(hi - grid_lo.xy) / size.xy)), vec2(0.0), most));
    last_cell.y = lo.x <= hi.x ? last_cell.y : -1;   // -1: no ray is in the slice
    cell = first_cell;
    return any_ahead && slice >= 0 && slice < resolution.z;
}

// Cells ------------------------------------------------------------------------------------------

bool any_left;

// Settle a shadow ray that has a hit.
void leave_ray(int r) {
    rays[r].t_min = search_over(hits[r]) ? NEVER : rays[r].t_min;
    any_left = any_left || rays[r].t_min < NEVER;
}

// Test the triangles of a cell, from entry `cursor` of the cell's list. Return false when all rays are
// settled, or at the step limit.
bool intersect(int cursor) {
    COUNT(leaves_visited);
    int next = reference_triangle(cursor);
    do {
        tested = next;
        ++cursor;
        next = reference_triangle(cursor);
        bool outside = culled(tested);
        while (outside && next >= 0) {
            tested = next;
            ++cursor;
            next = reference_triangle(cursor);
            outside = culled(tested);
        }
        if (!outside) {
            EACH(test_ray)
        }
        ++steps;
    } while (next >= 0 && steps < step_limit);
    any_left = true;
#ifdef ANY_HIT
    any_left = false;
    EACH(leave_ray)
#endif
    through = !any_left;
    return any_left && next < 0;
}

// Advance to the next cell that lists triangles, and test these triangles. Return false when the rays of
// the turn have finished, or at the step limit.
bool step_packet() {
    int cursor = -1;
    bool on = true;
    do {
        if (cell.y > last_cell.y) {
            on = enter_slice();
        }
        while (on && cursor < 0 && cell.y <= last_cell.y && steps < step_limit) {
            COUNT(nodes_visited);
            ++steps;
            cursor = grid_cell_first(cell.x * strides.x + cell.y * strides.y + slice * strides.z);
            bool wraps = cell.x == last_cell.x;
            cell = wraps ? ivec2(first_cell.x, cell.y + 1) : cell + ivec2(1, 0);
        }
    } while (on && cursor < 0 && steps < step_limit);
    through = !on;
    if (cursor >= 0) {
        on = intersect(cursor);
    }
    return on && steps < step_limit;
}
