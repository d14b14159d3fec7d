"""Bounding volume hierarchies: threaded, with a stack, and by packets."""
