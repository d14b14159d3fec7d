"""Bench: time methods and today's ray tracing engines on the same rays in one process."""
from __future__ import annotations

from .engines import ENGINES, Engine
from .race import NOISY, Entry, race, ranked, too_noisy
from .roofline import Peaks, peaks
from .work import Work, work_of
from .workloads import RAY_SETS, Workload, load, told, workload

__all__ = ["ENGINES", "NOISY", "RAY_SETS", "Engine", "Entry", "Peaks", "Work", "Workload",
           "load", "peaks", "race", "ranked", "told", "too_noisy", "work_of", "workload"]
