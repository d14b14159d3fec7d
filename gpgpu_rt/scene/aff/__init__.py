"""A reader of AFF, the file format of BART, which extends Haines's NFF 3.9.

BART is a benchmark for animated ray tracing (Lext, Assarsson and Möller 2001).
"""
