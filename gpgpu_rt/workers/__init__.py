"""Workers: rays shared among processes and machines, by Dask."""
from __future__ import annotations

from .workers import Workers

__all__ = ["Workers"]
