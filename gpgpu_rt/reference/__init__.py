"""Reference: the right answers to rays, and the oracle that judges the answers of an engine.

`trace` gives nearest hits in float64, `trace_exact` in integers. `acceptance` says which answers
are right for every engine that rounds to float32, and `check` judges answers: right, wrong or
undecidable, and by how much. docs/conformance.md derives the bounds.
"""
from .acceptance import Acceptance, acceptance, exact_hits
from .exact import trace_exact
from .nearest import as_rays, as_triangles, has_area, settle, trace
from .verdicts import KINDS, Verdicts, check

__all__ = ["Acceptance", "KINDS", "Verdicts", "acceptance", "as_rays", "as_triangles", "check",
           "exact_hits", "has_area", "settle", "trace", "trace_exact"]
