"""Accuracy: measures errors against the float64 reference, and finds the fastest method with
options that keeps given error bounds."""
