// No culling: every ray tests every triangle of a leaf.

void bound_frustum() {
}

bool culled(int i) {
    return false;
}
