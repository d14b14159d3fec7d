"""Bounding volume hierarchies: traversal along escape indices, with a stack, and by packets."""
