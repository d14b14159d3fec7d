"""Tiles of rays against every triangle (Szecsi 2006)."""
