"""Float32 by the rules: error bounds, and the numpy twins of the triangle test."""
