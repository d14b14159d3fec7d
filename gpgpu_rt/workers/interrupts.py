"""Interrupts: Ctrl-C comes to all processes of a terminal; local workers leave it to the one that
started them. Dask loads this in each, those that stand in for killed ones too."""
from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """What Dask calls as a worker starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
