// The triangle under test of a geometry image: the method cuts it from a cell, whose four corners are
// fetched once for two triangles, before it calls `test_triangle`. Stands in for the accessors of the
// triangle table.

vec3 image_v0;
vec3 image_v1;
vec3 image_v2;
int image_face;

vec3 triangle_v0(int i) {
    return image_v0;
}

vec3 triangle_v1(int i) {
    return image_v1;
}

vec3 triangle_v2(int i) {
    return image_v2;
}

int triangle_index(int i) {
    return image_face;
}
