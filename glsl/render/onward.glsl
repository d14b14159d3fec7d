// Where light goes on from a surface that mirrors or lets light through (Whitted 1980). Comes after
// surface.glsl, and after fresnel.glsl where there are DIELECTRICS.

struct Onward {
    vec3 direction;
    vec3 share;     // of the light from there, that goes back along the ray; zero: nothing goes on
    vec3 side;      // the flat normal on the side that the direction leaves to
};

// The reflected direction, or the refracted one.
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
    // A normal that was blended may send a ray through the triangle: the flat one does not.
    if (dot(on.direction, on.side) <= 0.0) {
        on.direction = reflect(on.direction, on.side);
    }
    return on;
}
