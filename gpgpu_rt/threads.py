"""Threads: divides long arrays among threads; numpy's loops release the interpreter lock."""
from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

WORTH = 10_000      # smallest number of triangles or rays that is shared among threads
MOST = 8            # largest number of threads; more would idle, because work has few parts

Run = Callable[..., Iterable[Any]]    # `map`, or the `map` of a thread pool


def cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def threads(count: int) -> Run:
    """Return a `map` over the parts of work on ``count`` triangles or rays.

    Results come in the order of the parts. If a part calls this function again, its inner parts
    run one after another on the same thread.
    """
    return map if count < WORTH or cores() < 2 else _shared_out


def _shared_out(function: Callable[..., Any], *parts: Iterable[Any]) -> Iterable[Any]:
    if getattr(_thread, "has_a_part", False):   # avoid a deadlock: all threads could wait
        return map(function, *parts)
    return _pool(min(cores(), MOST)).map(function, *parts)


_thread = threading.local()


def _begin() -> None:
    _thread.has_a_part = True


@lru_cache(maxsize=1)
def _pool(size: int) -> ThreadPoolExecutor:
    """Return the thread pool, which stays open: starting its threads takes as long as the work on
    a million hits."""
    return ThreadPoolExecutor(size, initializer=_begin)


if hasattr(os, "register_at_fork"):     # a forked process has no threads and needs a new pool
    os.register_at_fork(after_in_child=_pool.cache_clear)
