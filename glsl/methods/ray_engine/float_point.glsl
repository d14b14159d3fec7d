// The Ray Engine's test of a ray with a triangle, in floats: `test_triangle` of core/triangle.glsl.

#include "core/triangle.glsl"

#define test_pair test_triangle
