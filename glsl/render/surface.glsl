// The surface at a hit, with the properties that the scene requires (gpgpu_rt/render/needs.py sets the
// defines). A property that this surface lacks must not change a bit of the result. The code therefore adds
// zeros for such a property, and selects one of two values where a blend would round.

struct Surface {
    vec3 flat_normal;   // normal of the triangle, on the ray's side
    vec3 normal;        // shading normal, on the same side
    bool outside;       // whether the vertices run anticlockwise seen from the ray's side
    vec3 diffuse;
    int material;
};

#if defined(TEXTURES) || defined(SKY_IMAGE)
#include "render/texture.glsl"
#endif
#ifdef TEXTURES
uniform sampler2D images;
#endif
#ifndef COLOURS
uniform vec3 only_diffuse;
#endif
#ifndef MATERIALS
uniform int only_material;
#endif

Surface surface_at(Rays ray, Hit hit) {
    Surface surface;
    vec3 normal = surface_normal(hit.triangle);
    surface.outside = !(dot(normal, ray.direction) > 0.0);
    normal = dot(normal, ray.direction) > 0.0 ? -normal : normal;
    surface.flat_normal = normal;
#ifdef SMOOTH_NORMALS
    vec3 blended = (1.0 - hit.u - hit.v) * corner_normals_n0(hit.triangle)
                 + hit.u * corner_normals_n1(hit.triangle)
                 + hit.v * corner_normals_n2(hit.triangle);
    blended = dot(blended, normal) < 0.0 ? -blended : blended;
    // Keep the flat normal if the triangle is flat (its corner normals are zero). Keep it also if the
    // blended normal faces away from the ray, because that normal would shade the back side.
    bool usable = dot(blended, blended) > 1e-6 && dot(blended, ray.direction) < 0.0;
    normal = usable ? normalize(blended) : normal;
#endif
    surface.normal = normal;
#ifdef MATERIALS
    surface.material = surface_material(hit.triangle);
#else
    surface.material = only_material;
#endif
#ifdef COLOURS
    surface.diffuse = colour_diffuse(hit.triangle);
#else
    surface.diffuse = only_diffuse;
#endif
#ifdef TEXTURES
    ivec2 size = ivec2(image_width(surface.material), image_height(surface.material));
    if (size.x > 0) {
        vec2 uv = (1.0 - hit.u - hit.v) * corner_uv_uv0(hit.triangle)
                + hit.u * corner_uv_uv1(hit.triangle) + hit.v * corner_uv_uv2(hit.triangle);
        surface.diffuse *= image_at(images, ivec2(image_x(surface.material),
                                                  image_y(surface.material)), size, uv);
    }
#endif
    return surface;
}
