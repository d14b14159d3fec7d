"""Rasterisation as a helper of ray tracing (survey, section 5)."""
