"""A cell is one measurement of a figure. Helpers are worker processes that measure untimed cells
beside the main process. Helpers stop while the main process times a cell, and no cell is lost."""
from __future__ import annotations

import functools
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import gpgpu_rt as rt
from gpgpu_rt.disk import own_folder
from gpgpu_rt.figures.framework import aside, measure
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.framework.results import read
from gpgpu_rt.gl.context import is_software, open_gpu
from gpgpu_rt.workers import Workers, machine

pytest.importorskip("distributed")
import psutil  # noqa: E402  (distributed installs psutil)

TREES = [Cell("cornell", "kd-restart", (("max_depth", depth),), work="tree")
         for depth in range(4, 10)]
TIMED = [Cell("cornell", method, size=16, runs=1) for method in ("grid", "kd-restart")]


def _where(cell: Cell) -> dict[str, Any]:
    time.sleep(0.05)
    return {"pid": os.getpid()}


def _killed_once(flag: Path, cell: Cell) -> dict[str, Any]:
    if cell == TREES[2] and not flag.exists():
        flag.touch()
        os.kill(os.getpid(), 9)
    return _where(cell)


def _wrong(cell: Cell) -> dict[str, Any]:
    raise rt.Error(f"nothing of {cell.method}")


def test_each_cell_is_measured_once(workers: Workers) -> None:
    beside = aside.Aside(TREES, workers, _where)
    mine = [cell for cell in iter(beside.take, None)]
    found = [*beside.done(), *beside.done(wait=True)]
    assert sorted(TREES, key=str) == sorted([*mine, *(cell for cell, _ in found)], key=str)
    assert os.getpid() not in {result["pid"] for _, result in found}
    assert not list(beside.done(wait=True)), "a result came twice"


def test_a_killed_helper_loses_nothing(workers: Workers, tmp_path) -> None:
    before = set(workers.processes())
    found = dict(aside.Aside(TREES, workers, functools.partial(
        _killed_once, tmp_path / "killed")).done(wait=True))
    assert (tmp_path / "killed").exists() and set(found) == set(TREES)
    workers.client.wait_for_workers(2, timeout=300)
    assert len(before) == 2 and len(set(workers.processes()) - before) == 1


def test_an_error_of_a_helper_is_raised(workers: Workers) -> None:
    with pytest.raises(rt.Error, match="nothing of kd-restart"):
        list(aside.Aside(TREES, workers, _wrong).done(wait=True))


def test_helpers_stop_while_a_cell_is_timed(tmp_path) -> None:
    """Helpers stop while a cell is timed (`machine.alone`). They continue afterwards, even after
    an error."""
    with subprocess.Popen([sys.executable, "-uc", (
            "import time\nwhile True: print(time.monotonic()); time.sleep(0.005)")],
            stdout=subprocess.PIPE, text=True) as helper:
        assert helper.stdout is not None
        try:
            helper.stdout.readline()  # the helper has started
            spans = []
            with machine.helped(lambda: [helper.pid]):
                for _ in range(2):
                    with pytest.raises(KeyError), machine.alone():
                        began = time.monotonic()
                        time.sleep(0.4)
                        spans.append((began, time.monotonic()))
                        raise KeyError
                    time.sleep(0.2)
            with machine.alone():  # there is no helper now
                last = time.monotonic()
                time.sleep(0.1)
        finally:
            helper.kill()
        ticks = [float(line) for line in helper.stdout.read().split()]
    for began, ended in spans:
        assert not [t for t in ticks if began + 0.02 < t < ended]
    assert [t for t in ticks if spans[0][1] < t < spans[1][0]]
    assert [t for t in ticks if t > last]


def test_processes_of_a_helper_stop_too() -> None:
    """The processes that a helper started stop with the helper."""
    with subprocess.Popen([sys.executable, "-uc", (
            "import subprocess, sys\n"
            "one = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(99)'])\n"
            "print(one.pid)\ntry:\n    sys.stdin.read()\nfinally:\n    one.kill()")],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as helper:
        assert helper.stdout is not None
        started = int(helper.stdout.readline())

        def stand_still(those: int) -> bool:
            """Returns whether the number of stopped processes is ``those``. Waits up to 10 s for
            this state, because a signal takes a moment to arrive."""
            until = time.monotonic() + 10
            while time.monotonic() < until:
                states = [psutil.Process(pid).status() for pid in (helper.pid, started)]
                if states.count(psutil.STATUS_STOPPED) == those:
                    return True
                time.sleep(0.01)
            return False
        with machine.helped(lambda: [helper.pid]), machine.alone():
            assert stand_still(2)
        assert stand_still(0)


def test_threads_of_a_process_time_cells_one_by_one() -> None:
    """At any time, only one thread of a process times a cell. A Dask worker may have several
    threads, which would otherwise time several cells at once."""
    spans: list[tuple[float, float]] = []

    def time_something(k: int) -> None:
        with machine.taken(), machine.alone(), machine.alone():
            began = time.monotonic()
            time.sleep(0.02)
            spans.append((began, time.monotonic()))
            assert machine._held and machine._alone
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(time_something, range(8)))
    spans.sort()
    assert len(spans) == 8 and all(a[1] <= b[0] for a, b in zip(spans, spans[1:]))
    assert not machine._held and not machine._alone


def test_who_waits_for_the_machine_says_so(tmp_path, monkeypatch) -> None:
    """`machine.taken` calls the given function if it must wait for another process that holds the
    machine's exclusive lock."""
    monkeypatch.setattr(own_folder.tempfile, "gettempdir", lambda: str(tmp_path))
    said: list[str] = []
    with machine.taken(lambda: said.append("nobody is alone")):
        pass
    with subprocess.Popen([sys.executable, "-uc", (
            "import time\nfrom gpgpu_rt.workers.machine import alone\n"
            "with alone(): print('alone'); time.sleep(0.5)")], stdout=subprocess.PIPE, text=True,
            env={**os.environ, "TMPDIR": str(tmp_path)}) as other:
        assert other.stdout is not None and other.stdout.readline() == "alone\n"
        with machine.taken(lambda: said.append("waits")):
            assert other.wait() == 0
    assert said == ["waits"]


def test_figures_measure_untimed_cells_aside(tmp_path, monkeypatch) -> None:
    """Helpers return the same results as a single process. Only the main process measures timed
    cells."""
    monkeypatch.setattr(aside, "WORTH", 2)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1}, raising=False)
    asked: list[Cell] = []
    real = measure.measured
    monkeypatch.setattr(measure, "_here", lambda cells, _: (
        (asked.append(cell), (cell, real(cell)))[1] for cell in cells))
    stopped: list[int] = []
    signal = machine._signal
    monkeypatch.setattr(machine, "_signal", lambda processes, what: (
        stopped.extend(processes), signal(processes, what))[1])
    measure.measure([*TREES, *TIMED], tmp_path)
    assert len(list(tmp_path.iterdir())) == len(TREES) + len(TIMED)
    assert set(asked) >= set(TIMED)
    if is_software(open_gpu().renderer):
        assert stopped and os.getpid() not in stopped
    for cell in TREES:
        result = read(cell, tmp_path)
        assert result is not None and result["tree"] == real(cell)["tree"]
