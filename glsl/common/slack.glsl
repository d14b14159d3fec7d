// How far boxes are widened. Rounding must never lose a box that holds a hit, so they grow by
// BOX_SLACK of the largest distance between origin and scene, per axis: this covers the rounding
// of both the slabs and the triangle test (measured: no differing bit over millions of rays). It is
// done once a ray, by moving the origin that a box's corners are measured from.

uniform vec3 scene_lo;
uniform vec3 scene_hi;

const float BOX_SLACK = 64.0 * ARITHMETIC_UNIT;   // 3.8e-6 in float32

vec3 box_slack(vec3 origin) {
    return R(BOX_SLACK * R(max(abs(scene_lo - origin), abs(scene_hi - origin))));
}
