"""Traversal: what runs a method's programs over the rays, whatever the method."""
