// bvh-stack: the traversal of Günther, Popov, Seidel and Slusallek, RT 2007 (survey, section 3.5, Figure
// 22). A packet is one ray, so each ray enters its nearer child first.

#include "methods/bvh/bvh_packet.glsl"
