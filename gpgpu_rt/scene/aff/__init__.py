"""A reader of AFF, the file format of BART, a benchmark for animated ray tracing (Lext, Assarsson
and Möller 2001). AFF extends Haines's Neutral File Format, NFF 3.9."""
