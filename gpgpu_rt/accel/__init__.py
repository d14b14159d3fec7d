"""Accelerators: the parts that all builders share, in pure numpy and without OpenGL."""
