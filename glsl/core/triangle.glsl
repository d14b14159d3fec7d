// Ray against triangle. The four tests below report t, and u and v of the hit point p = (1 - u - v) v0 + u
// v1 + v v2. They do not cull back faces and never hit a triangle without area.

#include "core/pointer.glsl"

#ifdef IMAGE_CELLS
#include "methods/geometry_image/image_triangles.glsl"
#endif

// Keep a hit if it precedes the nearest hit so far in the order of (t, index). With AFTER_HIT, a ray starts
// at a hit; at t_min it accepts only triangles after that hit's triangle. The era form compares only t.
void accept(Ray ray, float t, float u, float v, int index, inout Hit hit) {
#ifdef AFTER_HIT
    bool ahead = t > ray.t_min || (t == ray.t_min && index > ray.after);
#else
    bool ahead = t >= ray.t_min;
#endif
#ifdef ERA
    if (ahead && t < hit.t) {
#else
    if (ahead && (t < hit.t || (t == hit.t && index < hit.triangle))) {
#endif
        hit = Hit(t, u, v, index);
    }
}

#ifdef INTERSECTION_WOOP_WATERTIGHT
#include "core/watertight.glsl"
#endif
#ifdef INTERSECTION_MOLLER_TRUMBORE
#include "core/moller_trumbore.glsl"
#endif
#ifdef INTERSECTION_PLUCKER
#include "core/plucker.glsl"
#endif
#ifdef INTERSECTION_KENSLER_SHIRLEY
#include "core/kensler_shirley.glsl"
#endif
