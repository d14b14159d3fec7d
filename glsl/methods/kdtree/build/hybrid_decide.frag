#version 330 core
// Splits each large node at the cheapest plane that hybrid_costs.frag found. Axis 3 marks a node that this
// pass does not split: a leaf, or a small node (at most `small` triangles).

#include <records>
#include "core/stream.glsl"

uniform float intersection_cost;
uniform int small;
uniform bool stop;

void main() {
    int i = element();
    Cell cell = cell_load(table_texel(i));
    Offer best = offer_load(table_texel(GROUPS * i));
    for (int group = 1; group < GROUPS; ++group) {
        Offer other = offer_load(table_texel(GROUPS * i + group));
        if (other.cost < best.cost || (other.cost == best.cost && other.axis < best.axis)) {
            best = other;
        }
    }
    bool inner = !stop && cell.count > small && best.cost < intersection_cost * float(cell.count);
    decision_store(Decision(best.plane, inner ? best.axis : 3, 0));
}
