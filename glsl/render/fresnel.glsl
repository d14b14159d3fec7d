// Unpolarised light at a smooth border between two transparent media: the exact equations of Fresnel and
// Snell (Born and Wolf, "Principles of Optics", 1.5), with total internal reflection. `ior` is the
// refractive index behind the border divided by the index before it. `cosine` is the cosine of the angle
// between the reversed incoming ray and the border's normal on the ray's side.
// gpgpu_rt/reference/sampling.py has the float64 version.
//
// Departure: differences of nearly equal numbers are replaced by quotients. Let c be `cosine`, t the angle
// of the refracted ray, g = ior cos t and s^2 = (1 - c)(1 + c). Then
//     c - g = (1 - ior^2) / (c + g),   ior^2 c - g = (1 - ior^2)(s^2 - ior^2 c^2) / (ior^2 c + g).
// So cancellation costs no digits, even for nearly equal media or near the critical angle.

float sine_squared(float cosine) {
    return max((1.0 - cosine) * (1.0 + cosine), 0.0);
}

// The cosine of the refracted ray's angle, times ior; 0 under total reflection.
float refracted_cosine(float cosine, float ior) {
    float square = cosine < 0.7 ? (ior - 1.0) * (ior + 1.0) + cosine * cosine
                                : ior * ior - sine_squared(cosine);
    return sqrt(max(square, 0.0));
}

// The reflected share of the light, in [0, 1].
float fresnel(float cosine, float ior) {
    float g = refracted_cosine(cosine, ior);
    float apart = (1.0 - ior) * (1.0 + ior);
    float across = apart / ((cosine + g) * (cosine + g));
    float inner = ior * cosine;
    float sum = ior * inner + g;
    float along = apart * (sine_squared(cosine) - inner * inner) / (sum * sum);
    return g > 0.0 ? min(0.5 * (across * across + along * along), 1.0) : 1.0;
}

// The refracted unit direction, for a unit direction that points against `normal`. Undefined if `fresnel`
// is 1.
vec3 refracted(vec3 direction, vec3 normal, float cosine, float ior) {
    float g = refracted_cosine(cosine, ior);
    float along = (1.0 - ior) * (1.0 + ior) / (cosine + g);
    return normalize(direction + along * normal);
}
