"""Rays on their way in, hits on their way out, and the textures between."""
