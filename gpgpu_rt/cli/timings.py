"""Timings: measures the parts of a command, from the process's start to the last file."""
from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .shared import print_table


class Timings:
    """The parts of a command's time.

    Attributes
    ----------
    parts : part -> seconds, in the order in which the parts ran
    """

    def __init__(self) -> None:
        self.parts = {"start and imports": since_start()}

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        began = time.perf_counter()
        try:
            yield
        finally:
            self.parts[name] = self.parts.get(name, 0.0) + time.perf_counter() - began

    def split(self, name: str, parts: dict[str, float]) -> None:
        """Replace a part by smaller parts; the remaining time keeps the part's name."""
        whole = self.parts.pop(name)
        self.parts.update(parts)
        self.parts[name] = max(0.0, whole - sum(parts.values()))

    def print(self) -> None:
        total = sum(self.parts.values())
        print_table(("part", "seconds", "share"),
                    [(name, f"{seconds:.3f}", f"{seconds / total:.0%}")
                     for name, seconds in (*self.parts.items(), ("sum", total))])


def since_start() -> float:
    """Return the seconds since this process started; without /proc, the process's CPU time."""
    try:
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        started = int(fields[19]) / os.sysconf("SC_CLK_TCK")    # 19: field 22 of proc(5)
        return time.clock_gettime(time.CLOCK_BOOTTIME) - started
    except (OSError, ValueError, IndexError, AttributeError):
        return time.process_time()
