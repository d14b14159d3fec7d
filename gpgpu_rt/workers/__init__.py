"""Workers: distribute rays and pictures to processes and machines, with Dask."""
from __future__ import annotations

from .workers import LOCAL, Workers

__all__ = ["LOCAL", "Workers"]
