"""Surfaces as images: cuts meshes open, flattens them and resamples them."""
