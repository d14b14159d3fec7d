"""Tests of every triangle against tiles of rays (Szecsi 2006)."""
