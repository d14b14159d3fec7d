"""Bench: time methods and today's ray tracing engines on the same rays in one process."""
from __future__ import annotations

from .engines import ENGINES, Engine
from .race import NOISY, Entry, race, ranked, too_noisy, uncertain
from .workloads import RAY_SETS, Workload, load, told, workload

__all__ = ["ENGINES", "NOISY", "RAY_SETS", "Engine", "Entry", "Workload", "load", "race",
           "ranked", "told", "too_noisy", "uncertain", "workload"]
