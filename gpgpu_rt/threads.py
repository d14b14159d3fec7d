"""Threads: they share work on long arrays, as numpy lets go of the interpreter in its loops."""
from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

WORTH = 10_000      # triangles or rays from which on arrays are long enough to share
MOST = 8            # threads: there are few parts

Run = Callable[..., Iterable[Any]]    # `map`, or a pool's


def cores() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def threads(count: int) -> Iterator[Run]:
    """What goes over parts of work on ``count`` triangles or rays: results come in the parts'
    order, whoever made them, and so what is made of them is the same."""
    if count < WORTH or cores() < 2:
        yield map
        return
    with ThreadPoolExecutor(min(cores(), MOST)) as pool:
        yield pool.map
