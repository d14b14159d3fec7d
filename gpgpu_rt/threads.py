"""Threads: they share work on long arrays, as numpy lets go of the interpreter in its loops."""
from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

WORTH = 10_000      # triangles or rays from which on arrays are long enough to share
MOST = 8            # threads: there are few parts

Run = Callable[..., Iterable[Any]]    # `map`, or a pool's


def cores() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def threads(count: int) -> Run:
    """What goes over parts of work on ``count`` triangles or rays: results come in the parts'
    order, whoever made them, and so what is made of them is the same. A part that shares out its
    work in turn goes over all of it itself."""
    return map if count < WORTH or cores() < 2 else _shared_out


def _shared_out(function: Callable[..., Any], *parts: Iterable[Any]) -> Iterable[Any]:
    if getattr(_thread, "has_a_part", False):   # it would wait for a thread that it holds itself
        return map(function, *parts)
    return _pool(min(cores(), MOST)).map(function, *parts)


_thread = threading.local()


def _begin() -> None:
    _thread.has_a_part = True


@lru_cache(maxsize=1)
def _pool(size: int) -> ThreadPoolExecutor:
    """It stays: to start threads takes half a millisecond, as long as a million hits do."""
    return ThreadPoolExecutor(size, initializer=_begin)


if hasattr(os, "register_at_fork"):     # threads do not outlive a fork
    os.register_at_fork(after_in_child=_pool.cache_clear)
