"""Workers: rays and pictures shared among processes and machines, by Dask."""
from __future__ import annotations

from .workers import LOCAL, Workers

__all__ = ["LOCAL", "Workers"]
