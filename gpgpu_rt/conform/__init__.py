"""Conform: tests any ray tracer with extreme cases whose exact answers are known.

See docs/conformance.md.
"""
from .case import FAMILIES, Case, Family
from .families import make_case
from .suite import Known, Row, family_names, installed, run

__all__ = ["Case", "FAMILIES", "Family", "Known", "Row", "family_names", "installed", "make_case",
           "run"]
