"""Accuracy: measures errors against the float64 reference, and finds the fastest method and
options that keep given error bounds."""
