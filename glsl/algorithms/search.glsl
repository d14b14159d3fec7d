// Which element is the one flagged with a given rank: a binary search in the prefix sums of the
// flags (D. Horn, GPU Gems 2, 2005), as a fragment can gather from anywhere and write one place. Of flags
// in four channels FLAG says which.

#ifndef FLAG
#define FLAG x
#endif

// The first i of [lo, hi) with more than `rank` flags among elements 0 to i; hi where there is none.
int find_flagged(int rank, int lo, int hi) {
    while (lo < hi) {
        int middle = (lo + hi) >> 1;
        if (sums_load(table_texel(middle + 1)).value.FLAG > float(rank)) {
            hi = middle;
        } else {
            lo = middle + 1;
        }
    }
    return lo;
}
