// Computes the reflected or refracted ray at a mirror or dielectric surface (Whitted 1980). Include this
// file after surface.glsl and, under DIELECTRICS, after fresnel.glsl.

struct Onward {
    vec3 direction;
    vec3 share;     // share of the light from this direction that goes back along the ray; 0: no ray
    vec3 side;      // the flat normal on the side of the outgoing direction
};

// The ray that continues from a surface: the refracted ray if `refracts`, else the reflected ray.
Onward onward(Surface surface, vec3 incoming, bool refracts) {
    Onward on = Onward(reflect(incoming, surface.normal), vec3(0.0), surface.flat_normal);
#ifdef MIRRORS
    on.share = refracts ? vec3(0.0) : mirror_share(surface.material);
#endif
#ifdef DIELECTRICS
    float ior = dielectric_ior(surface.material);
    if (ior > 0.0) {
        ior = surface.outside ? ior : 1.0 / ior;
        float cosine = min(-dot(incoming, surface.normal), 1.0);
        on.share = vec3(fresnel(cosine, ior));
        if (refracts) {
            on.share = 1.0 - on.share;
            on.direction = refracted(incoming, surface.normal, cosine, ior);
            on.side = -on.side;
        }
    }
#endif
    // A blended normal may send the ray to the wrong side of the triangle. Then reflect the ray with the
    // flat normal.
    if (dot(on.direction, on.side) <= 0.0) {
        on.direction = reflect(on.direction, on.side);
    }
    return on;
}
