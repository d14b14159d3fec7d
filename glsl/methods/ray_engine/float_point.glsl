// Tests a ray-triangle pair of the Ray Engine in floats, by `test_triangle` of core/triangle.glsl.

#include "core/triangle.glsl"

#define test_pair test_triangle
