// Begins every packet's walk at the root. Replaces packet_entry.glsl in programs without entry points.

int first_node(int root) {
    return root;
}

// Return the node at which a walk along escape indices continues: here always `to`. The version for packets
// that start at an entry (methods/bvh/entry_threads.glsl) may return another node.
int jumped(int to) {
    return to;
}

void push_links() {
}
