// How far boxes are widened. Rounding must never lose a box that holds a hit, so they grow by
// BOX_SLACK of the largest distance between origin and scene, per axis: this covers the rounding
// of both the slabs and the triangle test (measured: no differing bit over millions of rays). It is
// done once a ray, by moving the origin that a box's corners are measured from. ORIGIN_ULP of the
// origin is added, at least half the spacing of float32 there: else, in a scene far from 0, the sum
// would round back to the origin and widen nothing.

uniform vec3 scene_lo;
uniform vec3 scene_hi;

const float BOX_SLACK = 3.8e-6;
const float ORIGIN_ULP = 1.0 / 8388608.0;   // 2^-23

vec3 box_slack(vec3 origin) {
    return BOX_SLACK * max(abs(scene_lo - origin), abs(scene_hi - origin))
         + ORIGIN_ULP * abs(origin);
}
