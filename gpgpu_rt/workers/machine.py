"""Machine lock: a shared and an exclusive lock of this machine, so that timings run undisturbed.

Work holds the shared lock. A timing holds the exclusive lock, so it first waits until no other
process works.
"""
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

Processes = Callable[[], Iterable[int]]     # returns the ids of the running helper processes

_turn = threading.RLock()      # one thread at a time uses the machine lock
_held: list[IO[bytes]] = []    # the lock file, while this process has locked it
_alone: list[IO[bytes]] = []   # the lock file, while this process has locked it exclusively
_told: list[Callable[[], object]] = []    # the function to call before waiting for the lock
_helpers: list[Processes] = []     # functions that return the helpers of this process


@contextlib.contextmanager
def taken(waiting: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Return a context that holds the shared lock of this machine.

    Several processes can hold the shared lock at once, but only one thread of each process.
    ``waiting`` is called before each wait: for the shared lock, and for the exclusive lock that
    `alone` takes within the context.

    Notes
    -----
    The lock is an operating system lock on a file of this user, and ends with the process.
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
    """Return a context that holds the exclusive lock of this machine, for timings.

    While this process waits, it releases its shared lock (`taken`), so other processes may get the
    exclusive lock first. Within the context, the helpers of this process (`helped`) and the
    helpers' child processes are stopped.
    """
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
    """Return a context in which helpers work for this process. Helpers are other processes.

    While this process holds the exclusive lock (`alone`), its helpers are stopped in the middle of
    their work. Helpers need no lock themselves.

    Parameters
    ----------
    by : returns the ids of the helper processes

    Notes
    -----
    Use this context only for work on the CPU: a graphics card would go on working for a stopped
    helper. A stopped helper must not hold a lock for which the timed work waits. Mesa's
    single-file shader cache has such a lock, so helpers need ``MESA_DISK_CACHE_MULTI_FILE=1``.
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
            for process in by():
                # Stop the helper first, so that it starts no more processes.
                stopped.append(process)
                _signal([process], signal.SIGSTOP)
                begun = _started_by(process)
                stopped += begun
                _signal(begun, signal.SIGSTOP)
        yield
    finally:
        _signal(stopped, signal.SIGCONT)


def _started_by(process: int) -> list[int]:
    import psutil  # Dask, which all helpers use, installs psutil
    try:
        return [child.pid for child in psutil.Process(process).children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def _signal(processes: Iterable[int], what: signal.Signals) -> None:
    for process in processes:
        with contextlib.suppress(ProcessLookupError):    # the process has ended
            os.kill(process, what)


def _file() -> Path:
    """Return the lock file. Its name contains the host's name, because hosts may share a temporary
    folder."""
    return own_folder() / f"{platform.node()}.lock"
