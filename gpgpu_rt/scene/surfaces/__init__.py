"""Surfaces as images: meshes cut, laid flat and resampled."""
