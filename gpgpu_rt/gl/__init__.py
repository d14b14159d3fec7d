"""The OpenGL layer: contexts, programs and passes, and textures that hold records."""
