// Begins every packet's walk at the root. Replaces packet_entry.glsl in programs without entry points.

int first_node(int root) {
    return root;
}

// The node at which a walk along escape indices continues. Only a packet that starts at an entry jumps
// elsewhere.
int jumped(int to) {
    return to;
}

void push_links() {
}
