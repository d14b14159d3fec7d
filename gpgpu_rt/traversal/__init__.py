"""Traversal: the drivers that run any method's programs over the rays."""
