"""A reader of AFF, the animated file format of BART. BART is a benchmark for animated ray tracing
(Lext, Assarsson and Möller 2001). AFF extends Haines's Neutral File Format, NFF 3.9."""
