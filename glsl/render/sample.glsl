// Draw directions and points from random numbers in (0, 1) (see random.glsl), and compute their densities.
// Directions are local: z is the normal, or the mirror direction for a glossy lobe.
//
// Sine, cosine, logarithm and exponential are polynomials, with errors of a few float32 roundings. The
// driver's functions may have errors of 1e-4 (GLSL 330 guarantees nothing), which would be visible in a
// glossy lobe of small roughness. gpgpu_rt/reference/sampling.py has the float64 versions.

const float SAMPLE_PI = 3.14159265358979;

// (sine, cosine) by Taylor series for |angle| <= pi / 4, with errors of 2e-9 and 2e-10.
vec2 sine_and_cosine(float angle) {
    float x = angle * angle;
    float s = 1.0 + x * (-1.0 / 6.0 + x * (1.0 / 120.0 + x * (-1.0 / 5040.0 + x / 362880.0)));
    float c = 1.0 + x * (-0.5 + x * (1.0 / 24.0 + x * (-1.0 / 720.0
                                     + x * (1.0 / 40320.0 - x / 3628800.0))));
    return vec2(s * angle, c);
}

// 2 artanh(z) for |z| < 0.1716, with an error of 1e-9.
float twice_artanh(float z) {
    float y = z * z;
    float series = y * (1.0 / 3.0 + y * (1.0 / 5.0 + y * (1.0 / 7.0 + y * (1.0 / 9.0 + y / 11.0))));
    return 2.0 * (z + z * series);
}

// (sine, cosine) of an angle from (sine, cosine) of half the angle.
vec2 twice_the_angle(vec2 turn) {
    return vec2(2.0 * turn.x * turn.y, (turn.y - turn.x) * (turn.y + turn.x));
}

// The natural logarithm of x in (0, 1], with a small relative error: the exponent times ln 2, plus
// 2 artanh((m - 1) / (m + 1)) for a mantissa m in [sqrt(1/2), sqrt(2)). Near 1 only the second term
// remains.
float logarithm(float x) {
    uint bits = floatBitsToUint(x);
    int exponent = int((bits + 0x004afb0du) >> 23) - 127;   // the sum carries for a mantissa >= sqrt(2)
    float m = uintBitsToFloat(bits - uint(exponent << 23));
    return float(exponent) * 0.69314718056 + twice_artanh((m - 1.0) / (m + 1.0));
}

// -log(1 - r^2) for r in (0, 1), with a small relative error.
float minus_log_beside(float r) {
    float square = r * r;
    return square < 0.25 ? twice_artanh(square / (2.0 - square)) : -logarithm((1.0 - r) * (1.0 + r));
}

// exp(-x) for x >= 0, with a small relative error; 0 where the result is below float32's normal numbers.
float exponential_of_minus(float x) {
    float power = floor(x * 1.44269504 + 0.5);
    // ln 2 in two parts; the first part has so few bits that the product is exact.
    float r = (power * 0.693145751953125 - x) + power * 1.42860677e-6;
    float e = 1.0 + r * (1.0 + r * (1.0 / 2.0 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0
                   + r * (1.0 / 720.0 + r / 5040.0))))));
    return power < 126.0 ? e * uintBitsToFloat(uint(127 - int(power)) << 23) : 0.0;
}

// 1 - exp(-x) for x >= 0. Below 1/2 the result comes from a series, because the difference would lose
// digits.
float one_minus_exp(float x) {
    float series = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0
                 * (1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0)))))));
    return x < 0.5 ? series : 1.0 - exponential_of_minus(x);
}

// A point of the unit disc, and its distance from the centre: Shirley and Chiu's concentric map
// ("A Low Distortion Map Between Disk and Square", JGT 2(3), 1997). The distance is a coordinate of
// the square, so it has no rounding error.
vec3 sample_disc(vec2 random) {
    vec2 at = 2.0 * random - 1.0;
    bool across = abs(at.x) > abs(at.y);
    float r = across ? at.x : at.y;
    vec2 turn = sine_and_cosine(0.25 * SAMPLE_PI * ((across ? at.y : at.x) / r));
    return vec3(r * (across ? turn.yx : turn), abs(r));
}

// A direction with density cosine / pi (Malley's method).
vec3 sample_cosine(vec2 random) {
    vec3 disc = sample_disc(random);
    return vec3(disc.xy, sqrt((1.0 - disc.z) * (1.0 + disc.z)));
}

float cosine_density(float cosine) {
    return max(cosine, 0.0) / SAMPLE_PI;
}

// A direction with a density proportional to cos^n of its angle to z (Lafortune and Willems, "Using the
// Modified Phong Reflectance Model for Physically Based Rendering", 1994); `lobe_density` is the density.
// The square of the sine is 1 - u^(2 / (n + 1)), with u uniform in (0, 1).
vec3 sample_lobe(vec2 random, float exponent) {
    vec3 disc = sample_disc(random);
    // The disc's squared radius is uniform in (0, 1), and so is 1 minus the squared radius.
    float x = minus_log_beside(disc.z) / (exponent + 1.0);
    return vec3(disc.xy * (sqrt(one_minus_exp(2.0 * x)) / disc.z), exponential_of_minus(x));
}

float lobe_density(float cosine, float exponent) {
    return cosine > 0.0 ? (exponent + 1.0) / (2.0 * SAMPLE_PI)
        * exponential_of_minus(-exponent * logarithm(min(cosine, 1.0))) : 0.0;
}

// Weights u, v of a triangle's second and third corner for a point drawn uniformly from the triangle (Turk,
// "Generating Random Points in Triangles", Graphics Gems, 1990).
vec2 sample_triangle(vec2 random) {
    float s = sqrt(random.x);
    return vec2(s * (1.0 - random.y), s * random.y);
}

// An orthonormal basis whose third column is the unit vector z: Duff, Burgess, Christensen, Hery, Kensler,
// Liani and Villemin, "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
mat3 frame_around(vec3 z) {
    float sign_z = z.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (sign_z + z.z);
    float b = z.x * z.y * a;
    return mat3(vec3(1.0 + sign_z * z.x * z.x * a, sign_z * b, -sign_z * z.x),
                vec3(b, sign_z + z.y * z.y * a, -z.y), z);
}
