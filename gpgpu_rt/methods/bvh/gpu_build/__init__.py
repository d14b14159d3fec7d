"""Construction of bounding volume hierarchies by fragment passes."""
