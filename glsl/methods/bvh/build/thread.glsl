// Where a node stands in depth-first order. Before it come the leaves of all slots before its first
// one, as many inner nodes that part those leaves from each other and from it, and its ancestors that
// part its own leaves from later ones: those that have it on their left.

int node_place(Interval node) {
    return 2 * int(sums_load(table_texel(node.first)).value.x) + node.turns;
}
