"""Accuracy: errors against the float64 reference, and the fastest choice within error bounds."""
