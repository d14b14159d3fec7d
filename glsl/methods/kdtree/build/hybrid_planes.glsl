// Computes one group of candidate planes. Binned SAH divides the bounds of a node's pieces (the parts of
// triangles in the node) into BINS equal bins along each axis, as in gpgpu_rt/methods/kdtree/sah.py. The
// candidates are the ends of the bins. Along each axis, the candidates form GROUPS groups of four.

vec4 group_planes(Box box, int axis, int group) {
    float lo = box.lo[axis], hi = box.hi[axis];
    vec4 number = vec4(4 * group) + vec4(0.0, 1.0, 2.0, 3.0);
    PRECISE vec4 planes = lo + (hi - lo) * (number / float(BINS));
    return mix(planes, vec4(hi), greaterThanEqual(number, vec4(BINS)));
}
