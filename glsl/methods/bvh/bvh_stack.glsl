// bvh-stack: the traversal of Günther, Popov, Seidel and Slusallek, RT 2007 (survey, section 3.5, Figure
// 22), by packets of one ray. Each ray has a stack of its own and enters the nearer child first.

#include "methods/bvh/bvh_packet.glsl"
