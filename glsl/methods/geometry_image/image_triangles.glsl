// The current triangle of a geometry image. The method makes one or two triangles from a cell's corners,
// and calls `test_triangle` for each. The functions below replace the accessors of the triangle table.

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
