// Visibility field: Mortensen, Khanna, Yu, Slater, "A Visibility Field for Ray Tracing", CGIV 2007 (survey,
// section 5). A ray's direction selects a cell of the direction cube. The point where the ray crosses the
// cell's plane through the scene's centre selects a tile of this plane. Cell and tile select the beam that
// contains the ray. The beam has a list of candidate triangles in their order along the beam. A binary
// search finds where the ray starts in the list. From there the ray tests candidates until a candidate
// begins behind the hit. A ray that goes up the beam's axis tests the list forwards, and a ray that goes
// down tests the list backwards. A ray that crosses the plane outside all tiles hits nothing.
//
// Departure: a beam lists all triangles that rays of any direction in the beam's cell may meet. The paper's
// beam lists the triangles that rays of one sample direction meet. The error of the crossing point grows
// with the distance of the ray's origin. If this error may exceed the margin of the beams, the ray uses the
// list of its dominant axis, which holds all triangles.

uniform int directions;
uniform int tiles;
uniform int beam_count;
uniform vec3 scene_centre;
uniform vec3 half_size;
uniform float far_origin;

bool upward(Ray ray) {
    return permute(ray, ray.direction).z > 0.0;
}

// The number of the ray's beam; beam_count plus the axis if the ray uses the list of an axis; -1 if the ray
// misses the scene.
int beam_of(Ray ray) {
    int axis = ray.dominant.x ? 0 : (ray.dominant.y ? 1 : 2);
    vec3 origin = permute(ray, R(ray.origin - scene_centre));
    if (!(max_component(abs(origin)) <= far_origin)) {
        return beam_count + axis;
    }
    vec2 on_face = floor(R(ray.shear.xy * 0.5 + 0.5) * float(directions));
    vec2 window = clamp(on_face, 0.0, float(directions - 1));
    vec2 steep = (abs(2.0 * window + 1.0 - float(directions)) + 1.0) / float(directions);
    vec3 size = permute(ray, half_size);
    vec2 edge = size.xy + steep * size.z;
    vec2 crossing = R(origin.xy - R(ray.shear.xy * origin.z));
    vec2 tile = floor((crossing / edge + 1.0) * (0.5 * float(tiles)));
    if (any(lessThan(tile, vec2(0.0))) || any(greaterThanEqual(tile, vec2(tiles)))) {
        return -1;
    }
    int beam = (axis * directions + int(window.y)) * directions + int(window.x);
    return (beam * tiles + int(tile.y)) * tiles + int(tile.x);
}

// Bounds on the ray's coordinate along its dominant axis, at t. The ray passes the bound `earliest` at or
// before t, and the bound `latest` at or after t, despite rounding.
float earliest(Ray ray, float t) {
    float at = R(t * permute(ray, ray.direction).z);
    return R(permute(ray, upward(ray) ? ray.hi_origin : ray.lo_origin).z + at);
}

float latest(Ray ray, float t) {
    float at = R(t * permute(ray, ray.direction).z);
    return R(permute(ray, upward(ray) ? ray.lo_origin : ray.hi_origin).z + at);
}

void init(Ray ray, out State state) {
    COUNT(nodes_visited);
    int beam = beam_of(ray);
    state.first = beam < 0 ? 0 : beam_first(beam);
    state.end = state.first + (beam < 0 ? 0 : beam_entries(beam));
    state.low = state.first;
    state.high = state.end;
    state.phase = DONE;
    if (state.low < state.high) {
        COUNT(leaves_visited);
        state.phase = SEARCH;
    }
}

// Halve [low, high]. The `reach` of an entry is the farthest end of all entries up to this entry. A ray
// that goes up the axis starts at the first entry whose `reach` is not before the ray's start. A ray that
// goes down starts at the entry before the first entry whose `near` is above the ray's start.
void search(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    int middle = (state.low + state.high) / 2;
    float start = earliest(ray, ray.t_min);
    bool right = upward(ray) ? beam_entry_reach(middle) >= start : beam_entry_near(middle) > start;
    state.low = right ? state.low : middle + 1;
    state.high = right ? middle : state.high;
    if (state.low >= state.high) {
        state.low = upward(ray) ? state.low : state.low - 1;
        state.phase = state.low >= state.first && state.low < state.end ? INTERSECT : DONE;
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    int i = state.low;
    bool up = upward(ray);
    float end = latest(ray, hit.t);
    if (up ? beam_entry_near(i) > end : beam_entry_reach(i) < end) {
        state.phase = DONE;
        return;
    }
    COUNT(nodes_visited);
    bool between = up ? beam_entry_far(i) >= earliest(ray, ray.t_min) : beam_entry_far(i) >= end;
    if (between) {
        test_triangle(ray, beam_entry_triangle(i), hit);
    }
    state.low += up ? 1 : -1;
    if (search_over(hit) || state.low < state.first || state.low >= state.end) {
        state.phase = DONE;
    }
}
