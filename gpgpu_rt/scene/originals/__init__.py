"""Originals: the papers' scenes as their owners publish them, fetched and converted to meshes."""
