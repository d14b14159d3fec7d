"""Reduction times: measures how long two stream reductions and a scan take.

Stream reduction removes elements from a stream and closes the gaps.
"""
from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from gpgpu_rt.gl.algorithms.blocks import reduce_by_blocks
from gpgpu_rt.gl.algorithms.compact import compact
from gpgpu_rt.gl.algorithms.records import SORT_KEY, VALUES
from gpgpu_rt.gl.algorithms.scan import scan
from gpgpu_rt.gl.algorithms.streams import Stream, StreamRoom
from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.workers.machine import alone

WARM_UPS = 1


def measure(length: int, kept: float, runs: int) -> dict[str, list[float]]:
    """Return the seconds of each run of "scan", "blocks" and "whole". The three alternate.

    "scan" is a scan of the flags alone, "blocks" reduces by blocks, and "whole" reduces the whole
    stream at once.

    Parameters
    ----------
    length : number of elements
    kept : share of the elements that is kept, at random
    """
    gpu = open_gpu()
    flags = np.random.default_rng(length).random(length) < kept
    with gpu, StreamRoom(gpu) as room:
        items = room.stream(SORT_KEY, length, index=np.arange(length))
        values = room.stream(VALUES, length, value=np.repeat(flags[:, None], 4, 1))
        tasks: dict[str, Callable[[], Stream]] = {
            "scan": lambda: scan(room, values),
            "blocks": lambda: reduce_by_blocks(room, items, values),
            "whole": lambda: compact(room, items, values)}
        seconds: dict[str, list[float]] = {name: [] for name in tasks}
        with alone():
            for turn in range(WARM_UPS + runs):
                for name, task in tasks.items():
                    began = time.perf_counter()
                    result = task()
                    gpu.finish()
                    took = time.perf_counter() - began
                    if turn >= WARM_UPS:
                        seconds[name].append(took)
                    if name != "scan":
                        assert (result.read()["index"] == np.flatnonzero(flags)).all()
                    room.drop(result)
    return seconds


def rates(length: int, seconds: dict[str, list[float]]) -> dict[str, Any]:
    """Return the elements per second of "scan", "blocks" and "whole", from median times.

    "over scan" and "over whole" are the rate of "blocks" divided by that of "scan" or "whole".
    """
    median = {name: statistics.median(times) for name, times in seconds.items()}
    return {**{name: length / took for name, took in median.items()},
            "over scan": median["scan"] / median["blocks"],
            "over whole": median["whole"] / median["blocks"]}
