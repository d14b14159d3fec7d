"""Accelerators: builders in pure numpy, from triangles to arrays; no OpenGL here."""
