// Counters of the current ray or packet. Without STATISTICS these macros are empty.

#ifdef STATISTICS
Counters counters;
#define COUNT(counter) ++counters.counter
#define COUNT_SEVERAL(counter, number) counters.counter += number
#define CLEAR_COUNTERS counters = Counters(0, 0, 0)
#define LOAD_COUNTERS(texel) counters = counters_load(texel)
#define STORE_COUNTERS counters_store(counters)
#else
#define COUNT(counter)
#define COUNT_SEVERAL(counter, number)
#define CLEAR_COUNTERS
#define LOAD_COUNTERS(texel)
#define STORE_COUNTERS
#endif
