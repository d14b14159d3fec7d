// Emulation of the number formats of the cards of 2002-2006. STORAGE_FORMAT is the format of textures.
// Every result of a kernel is rounded to ARITHMETIC_FORMAT, as in R(a * b). Without these formats R and
// `stored` return their argument and cost nothing. gpgpu_rt/gl/precision.py rounds in the same way on the
// host.
//
// The GPU rounds a result to float32 before R rounds it to the format. The card rounded once. The two
// results differ for at most a few tenths of a percent of products and quotients.

const float INFINITE = uintBitsToFloat(0x7f800000u);   // t_max of a ray without an end

#if defined(STORAGE_FORMAT) || defined(ARITHMETIC_FORMAT)

float rounded(float x, uint dropped, float smallest, float quantum, float most) {
    uint below = (1u << dropped) - 1u;
    uint bits = floatBitsToUint(x);
    float multiple = x / quantum;
#if defined(ROUNDING_NEAREST)
    bits += (below >> 1) + ((bits >> dropped) & 1u);
    multiple = roundEven(multiple);
#elif defined(ROUNDING_UP)
    bits += x > 0.0 ? below : 0u;
    multiple = ceil(multiple);
#else
    multiple = trunc(multiple);
#endif
    float normal = uintBitsToFloat(bits & ~below);
    float result = clamp(abs(x) < smallest ? multiple * quantum : normal, -most, most);
    return abs(x) <= 3.402823466e38 ? result : x;   // infinities and NaN stay as they are
}

#endif

#ifdef STORAGE_FORMAT
float stored(float x) {
    return rounded(x, STORAGE_FORMAT);
}
vec2 stored(vec2 v) {
    return vec2(stored(v.x), stored(v.y));
}
vec3 stored(vec3 v) {
    return vec3(stored(v.xy), stored(v.z));
}
vec4 stored(vec4 v) {
    return vec4(stored(v.xy), stored(v.zw));
}
#else
#define stored(x) (x)
#endif

#ifdef ARITHMETIC_FORMAT
float R(float x) {
    return rounded(x, ARITHMETIC_FORMAT);
}
vec2 R(vec2 v) {
    return vec2(R(v.x), R(v.y));
}
vec3 R(vec3 v) {
    return vec3(R(v.xy), R(v.z));
}
#else
#define R(x) (x)
#define ARITHMETIC_UNIT 5.9604645e-8   // the unit roundoff of float32
#endif

// R_dot and R_cross round every intermediate result.
float R_dot(vec3 a, vec3 b) {
    PRECISE vec3 p = R(a * b);
    return R(R(p.x + p.y) + p.z);
}

vec3 R_cross(vec3 a, vec3 b) {
    PRECISE vec3 p = R(a.yzx * b.zxy);
    PRECISE vec3 q = R(a.zxy * b.yzx);
    return R(p - q);
}

float largest(vec3 v) {
    return max(max(v.x, v.y), v.z);
}
