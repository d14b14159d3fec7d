// Which five-dimensional box a ray lies in: Arvo and Kirk, "Fast Ray Tracing by Ray
// Classification", SIGGRAPH 1987 (survey, Table 1). The direction's largest component chooses a face
// of the direction cube (of equal ones x, then y: `dominant`), the
// others the place on it.
//
// A ray from outside the scene's box counts as starting where it enters it, which changes no hit: no
// triangle lies before. One from so far off that this point would be wrong by more than the lists
// allow for takes the list of its face, which holds all triangles.

uniform int origin_cells;
uniform int direction_cells;
uniform int box_count;
uniform vec3 origin_cell_size;
uniform vec3 scene_centre;
uniform float far_origin;

// Which face: twice the axis, and one more against it.
int face_of(Ray ray) {
    int axis = ray.dominant.x ? 0 : (ray.dominant.y ? 1 : 2);
    return 2 * axis + int(permute(ray, ray.direction).z < 0.0);
}

// The box, or behind the boxes a face, or -1 where the ray misses the scene.
int box_of(Ray ray) {
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    float t = max(interval.x, ray.t_min);
    if (!(t <= min(interval.y, ray.t_max))) {
        return -1;
    }
    int face = face_of(ray);
    if (!(max_component(abs(ray.origin - scene_centre)) <= far_origin)) {
        return box_count + face;
    }
    vec3 at = R(R(R(ray.origin + R(t * ray.direction)) - scene_lo) / origin_cell_size);
    ivec3 cell = ivec3(clamp(floor(at), 0.0, float(origin_cells - 1)));
    vec2 uv = (face & 1) == 1 ? -ray.shear.xy : ray.shear.xy;
    vec2 on_face = floor(R(uv * 0.5 + 0.5) * float(direction_cells));
    ivec2 window = ivec2(clamp(on_face, 0.0, float(direction_cells - 1)));
    int box = (face * direction_cells + window.y) * direction_cells + window.x;
    return ((box * origin_cells + cell.z) * origin_cells + cell.y) * origin_cells + cell.x;
}
