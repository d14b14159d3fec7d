"""Accelerators: the parts that builders share, in pure numpy and without OpenGL."""
