"""Accuracy: how far answers are from the oracle's, and the fastest choice that keeps a promise."""
