"""Numerics: error bounds of float32 arithmetic, and the shader's triangle test in numpy."""
