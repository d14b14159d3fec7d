// Finds the five-dimensional box of a ray: Arvo and Kirk, "Fast Ray Tracing by Ray Classification",
// SIGGRAPH 1987 (survey, section 5). The largest component of the direction chooses a face of the direction
// cube; among equal components x comes first, then y (`dominant`). The two other components choose the
// position on the face.
//
// A ray from outside the scene's box starts where it enters the box. The error of the entry point grows
// with the distance of the origin. If the error may exceed the error margin of the lists, the ray uses the
// list of its face, which holds all triangles.

uniform int origin_cells;
uniform int direction_cells;
uniform int box_count;
uniform vec3 origin_cell_size;
uniform vec3 scene_centre;
uniform float far_origin;

// The face of a ray: twice the axis, plus 1 if the direction is negative along the axis.
int face_of(Ray ray) {
    int axis = ray.dominant.x ? 0 : (ray.dominant.y ? 1 : 2);
    return 2 * axis + int(permute(ray, ray.direction).z < 0.0);
}

// The number of the ray's box; box_count plus the face if the ray uses the list of a face; -1 if the ray
// misses the scene.
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
