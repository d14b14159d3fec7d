"""Originals: downloads the papers' scenes from their owners, and converts them to meshes."""
