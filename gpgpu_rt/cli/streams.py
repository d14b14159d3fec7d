"""Streams: let a command work even if the caller closes a standard stream or stops reading."""
from __future__ import annotations

import os
import sys
from collections.abc import Callable


def printed(command: Callable[[], int]) -> int:
    """Run a command that prints, flush its output, and return its exit status.

    A stream that the caller closed (``>&-``) becomes the null device. Otherwise the command's
    first file would get the stream's descriptor, and libraries would print messages into the file.
    The status is 0 if the reader stops early, as in ``gpgpu-rt methods | head -1``.
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
