"""Scan, sort, reduce and compact streams by fragment passes."""
