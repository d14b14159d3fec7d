"""Times forty cells (measurements for figures) with one worker and with two workers.

Each worker's renderer has one thread.
"""
from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.framework.measure import measure
from gpgpu_rt.workers import Workers

TURNS = 3
WARM_UP = [Cell("cornell", "kd-restart", (), 64, "moved by eye rays")]
CELLS = [Cell("shirley6", "kd-restart", (("max_depth", depth),), 64,
              work=f"moved by {rays} rays")
         for depth in range(4, 24) for rays in ("eye", "random")]


def seconds(workers: Workers) -> float:
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        measure(CELLS, Path(folder), workers=workers)
        return time.perf_counter() - began


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    spent: dict[int, list[float]] = {1: [], 2: []}
    for turn in range(1 + TURNS):
        for count, times in spent.items():
            with Workers(count=count, threads=1) as workers:
                workers.client.wait_for_workers(count)
                # Run a cell in each process first, so that one-time costs are not measured.
                list(workers.map(_warm, [()] * 4 * count))
                took = seconds(workers)
            if turn:
                times.append(took)
    one, two = (statistics.median(times) for times in spent.values())
    ratios = [a / b for a, b in zip(*spent.values())]
    print(f"{len(CELLS)} cells: {one:.1f} s with one worker, {two:.1f} s with two; "
          f"{statistics.median(ratios):.2f} times as fast (by turn: "
          + ", ".join(f"{ratio:.2f}" for ratio in ratios) + ")")


def _warm() -> None:
    with tempfile.TemporaryDirectory() as folder:
        measure(WARM_UP, Path(folder))


if __name__ == "__main__":
    main()
