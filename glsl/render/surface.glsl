// What shading knows of the surface at a hit, no more of it than the scene has (see
// gpgpu_rt/render/needs.py, which sets the defines). A property that a program knows but this
// surface has not leaves the bits of the others alone: zeros are added, and what would round is
// chosen, not blended.

struct Surface {
    vec3 flat_normal;   // of the triangle, on the ray's side
    vec3 normal;        // to shade with, on the same side
    bool outside;       // whether that is the side on which vertices run anticlockwise
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
    // Flat triangles have zeros; and a blend that looks away from the eye would shade the back.
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
