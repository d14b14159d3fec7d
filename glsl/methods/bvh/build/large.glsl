// Which nodes are binned.

bool is_large(Interval node) {
    return node.last - node.first >= SMALL;
}
