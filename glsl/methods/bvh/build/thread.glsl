// A node's position in depth-first order: the number of nodes before it. Let L leaves lie before the node's
// first slot (place in triangle order). Each of these leaves has a gap behind it, and each gap has an inner
// node, which also lies before this node: together 2 * L nodes. All other nodes before this node are
// ancestors whose left subtree contains this node; `turns` counts these ancestors.

int node_place(Interval node) {
    return 2 * int(sums_load(table_texel(node.first)).value.x) + node.turns;
}
