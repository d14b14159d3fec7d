// Find the flagged element of a given rank by a binary search in the prefix sums of the flags (D. Horn, GPU
// Gems 2, 2005). A fragment cannot choose where it writes. So the fragment of each output position searches
// for the element that belongs there. If the sums have four channels, FLAG selects the channel.

#ifndef FLAG
#define FLAG x
#endif

// The first i of [lo, hi) with more than `rank` flags among elements 0 to i; hi if no such i exists.
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
