// Uniform grid: Purcell, Buck, Mark, Hanrahan, "Ray Tracing on Programmable Graphics Hardware", SIGGRAPH
// 2002 (survey, section 3.3, Figure 6). A ray steps from cell to cell by a 3D DDA. Each `intersect` step
// tests one entry of the cell's list. The list ends in a sentinel.
//
// PROXIMITY follows Karlsson and Ljungstedt, "Ray Tracing Fully Implemented on Programmable Graphics
// Hardware", master's thesis, Chalmers 2004. An empty cell stores the Chebyshev distance k to the nearest
// occupied cell, and the ray jumps k - 1 cells at once.
//
// Departure: Purcell et al. add an increment to t_next in each step. The rounding errors of the additions
// grow, so long walks miss cells. Here each step computes t_next from the integer cell.

#include "core/pointer.glsl"

uniform ivec3 grid_resolution;
uniform vec3 cell_size;

// The t at which the ray leaves cell `cell` along each axis.
vec3 cell_exit(Ray ray, ivec3 cell) {
    ivec3 ahead = ivec3(greaterThan(ray.inv_dir, vec3(0.0)));
    vec3 border = R(scene_lo + R(vec3(cell + ahead) * cell_size));
    return R(R(border - ray.origin) * ray.inv_dir);
}

ivec3 cell_at(Ray ray, float t) {
    vec3 at = R(R(R(ray.origin + R(t * ray.direction)) - scene_lo) / cell_size);
    return clamp(ivec3(floor(at)), ivec3(0), grid_resolution - 1);
}

#ifdef TEXEL_POINTERS
uniform pointer slice_step;   // from a cell to the next cell along z

pointer cell_pointer(ivec3 cell) {
    return pointer_to(cell.x + grid_resolution.x * cell.y) + slice_step * cell.z;
}
#else   // no uniform here: inside a loop, llvmpipe would fetch it for each lane
int cell_pointer(ivec3 cell) {
    return cell.x + grid_resolution.x * (cell.y + grid_resolution.y * cell.z);
}
#endif

// Enter a cell at t. Continue with the cell's list, or walk on if the cell is empty.
void visit(Ray ray, ivec3 cell, float t, inout State state) {
    COUNT(nodes_visited);
    state.cell = cell;
    state.t_enter = t;
    state.t_next = cell_exit(ray, cell);
    state.cursor = grid_cell_first(cell_pointer(cell));
    state.phase = TRAVERSE;
    if (!is_null(state.cursor)) {
        COUNT(leaves_visited);
        state.phase = INTERSECT;
    }
}

void init(Ray ray, out State state) {
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    float t = max(interval.x, ray.t_min);
    state.t_exit = min(interval.y, ray.t_max);
    state.cell = ivec3(0);
    state.t_next = vec3(0.0);
    state.cursor = NOWHERE;
    state.phase = DONE;
    if (t <= state.t_exit) {
        visit(ray, cell_at(ray, t), t, state);
    }
}

// Advance to the next cell. The search ends at the last cell, or if the ray has a hit inside the current
// cell. After a hit beyond the end of the cell the search continues, because a nearer hit may follow.
void traverse(Ray ray, inout State state, inout Hit hit) {
    float t = min_component(state.t_next);
    bvec3 leaves = equal(state.t_next, vec3(t));
    ivec3 forward = ivec3(sign(ray.inv_dir));
    ivec3 cell = state.cell + (leaves.x ? ivec3(forward.x, 0, 0)
                            : (leaves.y ? ivec3(0, forward.y, 0) : ivec3(0, 0, forward.z)));
    bool outside = any(lessThan(cell, ivec3(0)))
                || any(greaterThanEqual(cell, grid_resolution));
    bool ends = outside || hit.t < t;
#ifdef PROXIMITY
    int clear = -code_of(state.cursor) - 1;   // the number of cells ahead that are certainly empty
    if (clear >= 2) {
        float cells = max_component(R(abs(ray.direction) / cell_size));
        t = R(state.t_enter + R(float(clear) / cells));
        cell = cell_at(ray, t);
        ends = false;
    }
#endif
    state.phase = DONE;
    if (!ends && t < state.t_exit) {
        visit(ray, cell, t, state);
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    pointer triangle = reference_triangle(state.cursor);
    state.cursor = moved(state.cursor, 1);
    if (is_null(triangle)) {
        state.phase = TRAVERSE;
    } else {
        test_triangle(ray, triangle, hit);
        if (search_over(hit)) {
            state.phase = DONE;
        }
    }
}
