// Reads the entry list of a tile (stages/entry_points.frag), for a ray of the tile or for a smaller tile in
// it. Entries are the roots of the subtrees that the tile's rays have to search, in the order of the walk.
// A texel holds four entries. The texels of a tile lie `entry_tiles_across` texels apart.

const int LIST_END = -1;
const int WHOLE_TREE = -(1 << 24);

uniform int entry_tiles_across;

int entry_code(ivec2 tile, int i) {
    int code = entry_list_load(ivec2(tile.x + (i >> 2) * entry_tiles_across, tile.y)).codes[i & 3];
    return i < ENTRIES ? code : LIST_END;
}

// The code of an entry that represents a node and all nodes after it in the walk, not only the node's
// subtree. Only the last entry of a list can have such a code.
int rest_from(int node) {
    return -2 - node;
}

bool is_rest(int code) {
    return code < LIST_END;
}

int entry_node(int code, int root) {
    return code == WHOLE_TREE ? root : is_rest(code) ? -2 - code : code;
}
