"""A hierarchy over rays, none over triangles."""
