"""Scan, sort, reduction and compaction of streams by fragment passes."""
