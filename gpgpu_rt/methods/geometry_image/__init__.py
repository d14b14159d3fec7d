"""Geometry images as hierarchies (Carr et al. 2006)."""
