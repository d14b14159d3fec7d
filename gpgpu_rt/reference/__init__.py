"""Reference: the right answers to rays, and functions that judge the answers of a ray tracer.

`trace` finds nearest hits in float64, and `trace_exact` in integers. `acceptance` returns the
answers that an engine with float32 rounding may give. `check` judges an engine's answers.
docs/conformance.md derives the bounds.
"""
from .acceptance import Acceptance, acceptance, exact_hits
from .exact import trace_exact
from .nearest import as_rays, as_triangles, has_area, settle, trace
from .verdicts import KINDS, Verdicts, check

__all__ = ["Acceptance", "KINDS", "Verdicts", "acceptance", "as_rays", "as_triangles", "check",
           "exact_hits", "has_area", "settle", "trace", "trace_exact"]
