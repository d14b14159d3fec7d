"""A method with a hierarchy over the rays instead of the triangles."""
