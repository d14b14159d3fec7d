"""Threads: builders share a level's work, as numpy lets go of the interpreter in its loops."""
from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

WORTH = 10_000      # triangles from which on arrays are long enough to share
MOST = 8            # threads: a level has few parts

Run = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]    # `map`, or a pool's


@contextmanager
def threads(triangles: int) -> Iterator[Run]:
    """What goes over the parts of a level while a scene of so many triangles is built: results
    come in the parts' order, whoever made them, and so the structure is the same."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if triangles < WORTH or (cores or 1) < 2:
        yield map
        return
    with ThreadPoolExecutor(min(cores or 1, MOST)) as pool:
        yield pool.map
