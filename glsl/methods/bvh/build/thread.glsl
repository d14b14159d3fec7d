// The position of a node in depth-first order: the number of nodes before this node. Let L leaves lie
// before the node's first slot. These leaves, and the L inner nodes that separate them from each other and
// from the node, are 2 * L nodes. All other nodes before this node are ancestors that have the node in
// their left subtree. `turns` counts these ancestors.

int node_place(Interval node) {
    return 2 * int(sums_load(table_texel(node.first)).value.x) + node.turns;
}
