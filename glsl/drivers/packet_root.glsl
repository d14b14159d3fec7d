// Begins every packet's walk at the root: replaces packet_entry.glsl for packets without entries.

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
