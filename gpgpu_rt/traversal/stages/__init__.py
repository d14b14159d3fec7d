"""Stages before a traversal: sorted rays, entry points, rasterised bounds and first hits."""
