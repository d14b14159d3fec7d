"""Rays: converts arrays of rays to textures, and textures of hits to arrays."""
