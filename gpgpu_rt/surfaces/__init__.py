"""Surfaces as images: meshes cut, laid flat and resampled, and moved by a fragment program."""
