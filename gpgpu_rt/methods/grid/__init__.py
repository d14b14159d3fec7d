"""Uniform grids (Purcell et al. 2002; Karlsson and Ljungstedt 2004)."""
