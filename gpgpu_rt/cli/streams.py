"""Streams: stdout and stderr of a command, also where the caller closed them or stops reading."""
from __future__ import annotations

import os
import sys
from collections.abc import Callable


def printed(command: Callable[[], int]) -> int:
    """Run a command that prints, and flush what it printed; its exit status.

    A stream that the caller closed (``>&-``) becomes the null device: else the first file that the
    command opens would take the stream's number, and messages of libraries would go there. Where
    the reader went, as in ``gpgpu-rt methods | head -1``, the status is 0.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w"))
    try:
        try:
            return command()
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        for stream in (sys.stdout, sys.stderr):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return 0
