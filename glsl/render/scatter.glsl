// Computes reflection at a surface, and continues a path from the surface. `_Surfaces` of
// gpgpu_rt/reference/path.py is the float64 version.

struct Scatter {
    vec3 direction;     // direction of the incoming ray
    vec3 mirrored;
    vec3 glossy;        // share reflected by the glossy part; zero if the surface lacks this part
    vec3 mirror;        // share reflected by the mirror; zero if the surface lacks this part
    float exponent;
    float ior;          // 0 for an opaque surface
    vec3 chance;        // probabilities that the path continues with the diffuse, glossy or mirror part
};

Scatter scatter_of(Surface surface, vec3 direction) {
    Scatter scatter = Scatter(direction, reflect(direction, surface.normal), vec3(0.0), vec3(0.0),
                              0.0, 0.0, vec3(0.0));
#ifdef GLOSSY
    scatter.glossy = glossy_share(surface.material);
    scatter.exponent = glossy_exponent(surface.material);
#endif
#ifdef MIRRORS
    scatter.mirror = mirror_share(surface.material);
#endif
#ifdef DIELECTRICS
    scatter.ior = dielectric_ior(surface.material);
#endif
    vec3 one = vec3(1.0);
    vec3 shares = vec3(dot(surface.diffuse, one), dot(scatter.glossy, one),
                       dot(scatter.mirror, one));
    float total = shares.x + shares.y + shares.z;
    scatter.chance = total > 0.0 ? shares / total : vec3(0.0);
    return scatter;
}

// Whether the surface reflects light from directions other than the mirror direction.
bool scatters(Scatter scatter) {
    return scatter.ior == 0.0 && scatter.chance.x + scatter.chance.y > 0.0;
}

// Return the reflected share of the light from a direction, times the cosine. `density` becomes the density
// with which a path continues in this direction.
vec3 scattered(Surface surface, Scatter scatter, vec3 direction, out float density) {
    float cosine = max(dot(surface.normal, direction), 0.0);
#ifdef SMOOTH_NORMALS
    cosine = dot(surface.flat_normal, direction) > 0.0 ? cosine : 0.0;
#endif
    density = scatter.chance.x * cosine_density(cosine);
    vec3 reflected = surface.diffuse / SAMPLE_PI;
#ifdef GLOSSY
    if (scatter.chance.y > 0.0) {
        // A lobe that conserves energy (Lafortune and Willems 1994).
        float lobe = lobe_density(dot(scatter.mirrored, direction), scatter.exponent);
        density += scatter.chance.y * lobe;
        reflected += scatter.glossy * (lobe * (scatter.exponent + 2.0)
                                       / (scatter.exponent + 1.0));
    }
#endif
    return reflected * cosine;
}

// A blended normal may send a ray to the wrong side of the triangle; reflect this ray with the flat normal.
vec3 kept_off(vec3 direction, vec3 side) {
    return dot(direction, side) <= 0.0 ? reflect(direction, side) : direction;
}

struct Onward {
    vec3 direction;
    vec3 side;          // the normal on the side of the outgoing ray
    vec3 weight;        // factor for the light from this direction; zero where the path ends
    float density;      // density of the direction; zero for a mirror or dielectric
};

Onward onward(Surface surface, Scatter scatter, vec4 random) {
    Onward next = Onward(scatter.mirrored, surface.flat_normal, vec3(0.0), 0.0);
#ifdef DIELECTRICS
    if (scatter.ior > 0.0) {
        float ior = surface.outside ? scatter.ior : 1.0 / scatter.ior;
        float cosine = min(-dot(scatter.direction, surface.normal), 1.0);
        if (!(random.x < fresnel(cosine, ior))) {
            next.direction = refracted(scatter.direction, surface.normal, cosine, ior);
            next.side = -surface.flat_normal;
        }
        next.direction = kept_off(next.direction, next.side);
        next.weight = vec3(1.0);
        return next;
    }
#endif
    bool diffuse = random.x < scatter.chance.x;
    if (diffuse || random.x < scatter.chance.x + scatter.chance.y) {
        vec3 local = sample_cosine(random.zw);
        vec3 axis = surface.normal;
#ifdef GLOSSY
        if (!diffuse) {
            local = sample_lobe(random.zw, scatter.exponent);
            axis = scatter.mirrored;
        }
#endif
        next.direction = frame_around(axis) * local;
        vec3 reflected = scattered(surface, scatter, next.direction, next.density);
        next.weight = next.density > 0.0 ? reflected / next.density : vec3(0.0);
        return next;
    }
#ifdef MIRRORS
    if (scatter.chance.z > 0.0) {
        next.direction = kept_off(scatter.mirrored, surface.flat_normal);
        next.weight = scatter.mirror / scatter.chance.z;
    }
#endif
    return next;
}
