// A node's position in depth-first order: the number of nodes before it. Let L leaves lie before the
// node's first slot (place in triangle order). These leaves, and the L inner nodes that separate
// them from each other and from the node, are 2 * L nodes. All other nodes before the node are ancestors
// with the node in the left subtree; `turns` counts these.

int node_place(Interval node) {
    return 2 * int(sums_load(table_texel(node.first)).value.x) + node.turns;
}
