"""In the past, Dask's default settings applied: a worker that was killed twice within 15 s was not
restarted. After the loss of the last worker, a sweep waited for ever."""
from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator

import pytest

import gpgpu_rt as rt

pytest.importorskip("distributed")

from gpgpu_rt.workers import Workers  # noqa: E402


def _dies() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture
def in_time() -> Iterator[None]:
    """Raises TimeoutError after 300 s, because the fault made the test wait for ever."""
    def late(*_: object) -> None:
        raise TimeoutError("no answer after 300 s")
    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(300)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.full
@pytest.mark.once
def test_a_worker_that_was_killed_is_restarted(in_time: None) -> None:
    with Workers(count=1, threads=1) as workers:
        began = time.monotonic()
        while time.monotonic() - began < 20:
            with pytest.raises(rt.Error, match="died repeatedly"):
                list(workers.map(_dies, [()]))
        workers.client.wait_for_workers(1, timeout=120)
        assert list(workers.map(abs, [(-3,)])) == [(0, 3)]
