// A node is large if it has more than SMALL triangles. The splits of a large node lie between bins.

bool is_large(Interval node) {
    return node.last - node.first >= SMALL;
}
