"""Inspect: shows the passes, the costs and the programs of a traversal."""
