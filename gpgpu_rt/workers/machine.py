"""Machine: what its processes agree on, whoever started them: is something timed there now?"""
from __future__ import annotations

import contextlib
import fcntl
import os
import platform
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

_held: list[IO[bytes]] = []    # the file that this process holds the machine by, while it does


@contextlib.contextmanager
def taken() -> Iterator[None]:
    """Hold this machine side by side with others that do; wait while one holds it alone.

    Notes
    -----
    A lock of the operating system's on a file of this user's: it goes with the process that holds
    it, however that ends. It is a process's, not a thread's.
    """
    if _held:
        yield
        return
    with _file().open("ab") as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        _held.append(file)
        try:
            yield
        finally:
            _held.pop()


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Wait until nobody else holds this machine, and keep everybody out meanwhile: for what is
    timed. Within `taken`, others may come first: the machine is let go while it is waited for."""
    with taken():
        fcntl.flock(_held[0], fcntl.LOCK_EX)
        try:
            yield
        finally:
            fcntl.flock(_held[0], fcntl.LOCK_SH)


def _file() -> Path:
    """Named by the host too: folders for temporary files may be shared."""
    return Path(tempfile.gettempdir()) / f"gpgpu_rt-{platform.node()}-{os.getuid()}.lock"
