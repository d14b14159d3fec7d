// The pair test of the Ray Engine in floats: the tests of core/triangle.glsl.

#include "core/triangle.glsl"

#define test_pair test_triangle
