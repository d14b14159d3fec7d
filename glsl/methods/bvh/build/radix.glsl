// Counts the leading bits that the Morton codes of two slots share. A slot is a position in the sorted
// order of the codes. From these counts, each inner node of the binary tree finds its span of slots,
// without a descent from the root. Each gap between two neighbouring slots is a node. The node spans all
// slots that share the common leading bits of the two neighbours. Departure: Lauterbach et al. 2009 sort a
// list of all splits with their levels.

uniform int slots;

const int SLOT_BITS = 24;

// The position of the highest set bit of x, for 0 < x < 2^24; far below zero for x = 0.
int highest_bit(int x) {
    return (floatBitsToInt(float(x)) >> 23) - 127;
}

ivec2 slot_code(int slot) {
    Sort_key key = sort_key_load(table_texel(slot));
    return ivec2(key.hi, key.lo);
}

// The number of leading bits that slots i and j share, where `code` is the code of slot i; -1 if slot j
// does not exist. If the codes are equal, the numbers of the slots supply SLOT_BITS further bits.
int shared_bits(ivec2 code, int i, int j) {
    ivec2 differ = code ^ slot_code(clamp(j, 0, slots - 1));
    int bits = differ.x != 0 ? 14 - highest_bit(differ.x)
             : differ.y != 0 ? 29 - highest_bit(differ.y)
             : 29 + SLOT_BITS - highest_bit(i ^ j);
    return j < 0 || j >= slots ? -1 : bits;
}

int gap_bits(int gap) {
    return gap < 0 ? -1 : shared_bits(slot_code(gap), gap, gap + 1);
}

// The gap whose node is the parent of the span of slots first ... last; -1 for the span of all slots. The
// result is the gap at one end of the span: the gap whose neighbours share more bits. If the result is
// `last`, the span is the left child, else the right child.
int parent_gap(int first, int last) {
    int before = gap_bits(first - 1), after = gap_bits(last);
    return max(before, after) < 0 ? -1 : after > before ? last : first - 1;
}
