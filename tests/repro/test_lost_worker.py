"""A worker killed twice within 15 s was given up by Dask, and with the last one a sweep hung."""
from __future__ import annotations

import os
import signal
import time

import pytest

import gpgpu_rt as rt

pytest.importorskip("distributed")

from gpgpu_rt.workers import Workers  # noqa: E402


def _dies() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.full
@pytest.mark.once
def test_a_worker_that_was_killed_comes_back() -> None:
    with Workers(count=1, threads=1) as workers:
        began = time.monotonic()
        while time.monotonic() - began < 20:
            with pytest.raises(rt.Error, match="again and again"):
                list(workers.map(_dies, [()]))
        workers.client.wait_for_workers(1, timeout=120)
        assert list(workers.map(abs, [(-3,)])) == [(0, 3)]
