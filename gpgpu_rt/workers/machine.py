"""Machine: what its processes agree on, whoever started them: is something timed there now?"""
from __future__ import annotations

import contextlib
import fcntl
import os
import platform
import tempfile
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def taken(alone: bool) -> Iterator[None]:
    """Wait until this machine is free for what follows, and hold it.

    Parameters
    ----------
    alone : nothing else that takes the machine runs meanwhile; False: others may, side by side

    Notes
    -----
    A lock of the operating system's on a file of this user's: it goes with the process that holds
    it, however that ends.
    """
    with _file().open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        yield


def _file() -> Path:
    """Named by the host too: folders for temporary files may be shared."""
    return Path(tempfile.gettempdir()) / f"gpgpu_rt-{platform.node()}-{os.getuid()}.lock"
