"""On a busy machine, a local worker process may take longer to end than Dask waits. In the past,
`make figures` then ended with a traceback, although all measurements were complete."""
from __future__ import annotations

import contextlib
import os
import time

import pytest

pytest.importorskip("distributed")

from gpgpu_rt.workers import Workers  # noqa: E402


def is_running(process: int) -> bool:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, 0)
        with open(f"/proc/{process}/stat", encoding="utf-8") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    return False


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs /proc")
def test_a_process_that_ends_too_late_is_killed(monkeypatch) -> None:
    def late() -> None:
        raise TimeoutError

    workers = Workers(count=1, threads=1)
    process, = workers.processes()
    end = workers._cluster.close
    try:
        monkeypatch.setattr(workers._cluster, "close", late)
        workers.close()
        began = time.monotonic()
        while is_running(process):
            assert time.monotonic() - began < 60, f"process {process} is still running"
            time.sleep(0.05)
    finally:
        end()
