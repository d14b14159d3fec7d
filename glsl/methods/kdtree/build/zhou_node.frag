#version 330 core
// Writes a node of the finished tree. A leaf also gets its pieces (zhou.glsl): a small leaf as a mask, a
// large leaf as consecutive elements of the list of pieces.

#include <records>
#include "core/fetch.glsl"
#include "methods/kdtree/build/zhou.glsl"

#ifdef LARGE
uniform int small;
uniform int first_stuck;
#endif

flat in int source;

void main() {
    ivec2 texel = table_texel(source);
    int pair = place_load(texel).pair;
#ifdef LARGE
    Decision decision = decision_load(texel);
    Built built = Built(decision.plane, decision.axis, pair, 0, vec4(0.0), 0);
    if (decision.axis == 3) {
        int count = cell_load(texel).count;
        int held = int(ranks_load(texel).value.y);
        built = Built(0.0, 3, 0, count > small ? count : 0, vec4(0.0), first_stuck + held);
    }
#else
    Choice choice = choice_load(texel);
    Node node = node_load(texel);
    Built built = choice.inner != 0
        ? Built(choice.plane, choice.face % 3, pair, 0, vec4(0.0), 0)
        : Built(0.0, 3, 0, population(mask_bits(node.mask)), node.mask, node.base);
#endif
    built_store(built);
}
