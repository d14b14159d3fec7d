// bvh-stack: the traversal of Günther, Popov, Seidel and Slusallek, RT 2007 (survey, section 3.5, Figure
// 22), with packets of one ray, so that each ray enters the nearer child first.

#include "methods/bvh/bvh_packet.glsl"
