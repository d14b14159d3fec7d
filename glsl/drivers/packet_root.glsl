// Every packet begins its walk at the root. This file replaces packet_entry.glsl for packets without entries.

int first_node(int root) {
    return root;
}

// The node at which a walk along escape indices continues. Only a packet that starts at an entry has jumps,
// so this function returns its argument.
int jumped(int to) {
    return to;
}

void push_links() {
}
