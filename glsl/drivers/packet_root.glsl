// Every packet begins its walk at the root. The counterpart of packet_entry.glsl.

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
