// Every packet begins its walk at the root.

int first_node(int root) {
    return root;
}

// The node that a walk along escape indices goes to.
int jumped(int to) {
    return to;
}

void push_links() {
}
