"""Reference: nearest hits of rays and triangles in float64 and in rational numbers."""
from .exact import trace_exact
from .nearest import as_rays, as_triangles, has_area, settle, trace

__all__ = ["as_rays", "as_triangles", "has_area", "settle", "trace", "trace_exact"]
