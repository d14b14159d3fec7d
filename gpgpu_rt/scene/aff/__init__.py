"""Reads AFF, the file format of BART. AFF extends Haines's file format NFF 3.9.

BART is a benchmark for animated ray tracing (Lext, Assarsson and Möller 2001).
"""
