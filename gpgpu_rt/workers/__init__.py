"""Workers: share rays and pictures among processes and machines by Dask."""
from __future__ import annotations

from .workers import LOCAL, Workers

__all__ = ["LOCAL", "Workers"]
