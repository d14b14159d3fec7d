// What slots of the sorted order share. The binary tree over them needs no search from the top down:
// where neighbours part is a node (a "gap"), and the node spans all slots that share what the two
// share (Lauterbach et al. 2009 list such splits with their levels, and sort that list).

uniform int slots;

const int SLOT_BITS = 24;

// The highest bit set in 0 < x < 2^24, from the exponent of the number as a float; far below zero
// for zero.
int highest_bit(int x) {
    return (floatBitsToInt(float(x)) >> 23) - 127;
}

ivec2 slot_code(int slot) {
    Sort_key key = sort_key_load(table_texel(slot));
    return ivec2(key.hi, key.lo);
}

// Leading bits that slot i, of that code, and slot j share; -1 for a slot outside. Equal codes are
// told apart by the slots themselves; a slot shares more with itself than there are bits.
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

// The gap that joins the span of slots first ... last to its sibling, or -1 for the whole: of the
// gaps at its two ends the one that parts later. Its own last slot says on which side we are.
int parent_gap(int first, int last) {
    int before = gap_bits(first - 1), after = gap_bits(last);
    return max(before, after) < 0 ? -1 : after > before ? last : first - 1;
}
