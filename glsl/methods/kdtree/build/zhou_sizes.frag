#version 330 core
// Counts the nodes in the subtree of each node of a level: 1 plus the sizes of the children, which an
// earlier pass computed. The size of a small root (a small node whose parent is large) comes from the list
// of small nodes.

#include <records>
#include "core/stream.glsl"

#ifdef LARGE
uniform int first_root;
#endif

void main() {
    int i = element();
    int rank = int(ranks_load(table_texel(i)).value.x);
    bool inner = int(ranks_load(table_texel(i + 1)).value.x) > rank;
    float size = 1.0;
    if (inner) {
        size += below_load(table_texel(2 * rank)).value.x
            + below_load(table_texel(2 * rank + 1)).value.x;
    }
#ifdef LARGE
    int root = int(starts_load(table_texel(i)).value.z);
    if (int(starts_load(table_texel(i + 1)).value.z) > root) {
        size = roots_load(table_texel(first_root + root)).value.x;
    }
#endif
    values_store(Values(vec4(size, 0.0, 0.0, 0.0)));
}
