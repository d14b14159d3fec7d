"""Scenes: triangles, materials, lights and cameras, from files, arrays or built-in generators."""
