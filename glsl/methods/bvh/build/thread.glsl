// The position of a node in depth-first order. With L leaves before the node's first slot, 2 L nodes come
// before it: these leaves, and the L inner nodes that separate these leaves from each other and from the
// node. The ancestors that have the node in their left subtree also come before it. The field `turns`
// counts these ancestors.

int node_place(Interval node) {
    return 2 * int(sums_load(table_texel(node.first)).value.x) + node.turns;
}
