// Counters of the present ray. Without STATISTICS, COUNT is nothing and costs nothing.

#ifdef STATISTICS
Counters counters;
#define COUNT(counter) ++counters.counter
#else
#define COUNT(counter)
#endif
