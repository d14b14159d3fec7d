"""Machine: what its processes agree on, whoever started them: is something timed there now?"""
from __future__ import annotations

import contextlib
import fcntl
import os
import platform
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import IO

from ..disk.own_folder import open_lock, own_folder

Processes = Callable[[], Iterable[int]]     # their numbers, now

_turn = threading.RLock()      # of this process's threads, which hold the machine in turns
_held: list[IO[bytes]] = []    # the file that this process holds the machine by, while it does
_alone: list[IO[bytes]] = []   # the same, while it keeps everybody out
_told: list[Callable[[], object]] = []    # by whoever holds it: what to call before waiting
_helpers: list[Processes] = []     # of this process: they stand still while it is alone


@contextlib.contextmanager
def taken(waiting: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Hold this machine side by side with other processes that do; while one holds it alone, call
    ``waiting`` and wait, within it also before waiting to be `alone`. Threads of a process take
    turns.

    Notes
    -----
    A lock of the operating system's on a file of this user's: it goes with the process that holds
    it, however that ends.
    """
    with _turn:
        if _held:
            yield
            return
        with open_lock(_file()) as file:
            _lock(file, fcntl.LOCK_SH, waiting)
            _held.append(file)
            _told.append(waiting)
            try:
                yield
            finally:
                _held.pop()
                _told.pop()


def _lock(file: IO[bytes], how: int, waiting: Callable[[], object]) -> None:
    try:
        fcntl.flock(file, how | fcntl.LOCK_NB)
    except BlockingIOError:
        waiting()
        fcntl.flock(file, how)


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Wait until nobody else holds this machine, and keep everybody out meanwhile: for what is
    timed. Within `taken`, others may come first: the machine is let go while it is waited for.
    Helpers of this process, and what they started, stand still."""
    with taken():
        if _alone:
            yield
            return
        _lock(_held[0], fcntl.LOCK_EX, _told[0])
        _alone.extend(_held)
        try:
            with _helpers_stopped():
                yield
        finally:
            _alone.clear()
            fcntl.flock(_held[0], fcntl.LOCK_SH)


@contextlib.contextmanager
def helped(by: Processes) -> Iterator[None]:
    """Within it, processes of this machine work for this one, and are stopped in the midst of what
    they do while it holds the machine `alone`: they need not hold it themselves.

    Notes
    -----
    For work on the processor: a graphics card would go on with what it was given. A helper that
    holds a lock which the timed work waits for would stop it for ever: Mesa's cache in one file
    has such a lock, so its helpers are to have another (``MESA_DISK_CACHE_MULTI_FILE=1``).
    """
    _helpers.append(by)
    try:
        yield
    finally:
        _helpers.remove(by)


@contextlib.contextmanager
def _helpers_stopped() -> Iterator[None]:
    stopped: list[int] = []
    try:
        for by in _helpers:
            for process in by():    # itself first: then it starts no more
                stopped.append(process)
                _signal([process], signal.SIGSTOP)
                begun = _started_by(process)
                stopped += begun
                _signal(begun, signal.SIGSTOP)
        yield
    finally:
        _signal(stopped, signal.SIGCONT)


def _started_by(process: int) -> list[int]:
    import psutil  # Dask's, as the helpers are
    try:
        return [child.pid for child in psutil.Process(process).children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def _signal(processes: Iterable[int], what: signal.Signals) -> None:
    for process in processes:
        with contextlib.suppress(ProcessLookupError):    # it has ended
            os.kill(process, what)


def _file() -> Path:
    """Named by the host too: folders for temporary files may be shared among hosts."""
    return own_folder() / f"{platform.node()}.lock"
