"""A cell: one measurement that a figure needs."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gpgpu_rt.bench.workloads import EYE

# The `method` of cells whose rays embreex traces on the CPU. Their option `threads` is the number
# of threads.
ON_CPU = "embreex"
# Comparisons with the papers use this triangle test, which was usual in the papers' time. The
# default watertight test dates from 2013.
PERIOD_TEST = ("intersection", "moller-trumbore")
# The `work` of a cell that counts how often a card issues kernels (hardware/image_issues.py):
# "issues of RAYS on CHIP".
ISSUES, ON_CHIP = "issues of ", " on "


@dataclass(frozen=True)
class Cell:
    """One measurement: a scene, a method with options, and the work to do on the scene.

    Most kinds of work trace ``size`` x ``size`` rays, ``runs`` times.
    """

    scene: str
    method: str
    options: tuple[tuple[str, Any], ...] = ()
    size: int = 256
    work: str = EYE      # a workload, or the name of a row of `works.WORKS`
    runs: int = 5

    @property
    def name(self) -> str:
        """The name of the cell's result file."""
        words = [self.scene, self.method, *(f"{k}={v}" for k, v in self.options),
                 f"{self.size}x{self.size}", self.work, f"{self.runs}"]
        return "".join(c if c.isalnum() or c in "=.-" else "_" for c in "-".join(words)) + ".json"


def timed_runs(full: bool) -> int:
    """Return the number of timed runs of a cell. The median of the runs is the result."""
    return 5 if full else 3
