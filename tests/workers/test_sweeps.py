"""A sweep measures cells with workers; a cell is one measurement of a figure. The results equal
the results of a single process, and a timed cell runs alone on its machine."""
from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import gpgpu_rt as rt
from gpgpu_rt.disk import own_folder
from gpgpu_rt.figures.command import main
from gpgpu_rt.figures.framework import measure, results, sweep
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.scene import catalogue
from gpgpu_rt.workers import Workers, machine, meshes

pytest.importorskip("distributed")

TREES = [Cell("cornell", "kd-restart", (("max_depth", depth),), work="tree")
         for depth in range(4, 10)]
# A sweep sorts cells by the names of scenes. This scene comes after the scene of TREES.
TIMED = [Cell("shirley6", method, size=16, runs=1) for method in ("grid", "kd-restart")]
NOT_THE_CELLS = ("processor_seconds", "date")  # values that differ from run to run


def read(folder: Path) -> dict[str, Any]:
    """Returns the content of every file of cells, without the values that differ from run to
    run."""
    return {path.name: {name: value for name, value in json.loads(path.read_text()).items()
                        if name not in NOT_THE_CELLS} for path in folder.iterdir()}


def _killing(flag: Path, cell: Cell) -> dict[str, Any]:
    """Measures a cell, but kills the worker when the third tree is measured for the first time."""
    if cell == TREES[2] and not flag.exists():
        flag.touch()
        os.kill(os.getpid(), 9)
    return measure.measured(cell)


def test_a_sweep_equals_one_process(workers: Workers, tmp_path, monkeypatch) -> None:
    """Workers measure the same cells as a single process, even if a worker is killed."""
    for cell in TREES:  # a single cell is measured without workers
        measure.measure([cell], tmp_path / "alone")
    flag = tmp_path / "killed"
    monkeypatch.setattr(measure, "measured", functools.partial(_killing, flag))
    measure.measure(TREES, tmp_path / "shared", workers=workers)
    assert flag.exists()
    assert read(tmp_path / "shared") == read(tmp_path / "alone")
    assert len(read(tmp_path / "shared")) == len(TREES)
    # A second sweep measures no cell again.
    monkeypatch.setattr(sweep, "results", lambda *_: pytest.fail("measured again"))
    measure.measure(TREES, tmp_path / "shared", workers=workers)


def test_an_interrupted_sweep_keeps_its_results(workers: Workers, tmp_path, monkeypatch) -> None:
    whole, shared = measure._write, sweep.results

    def write(cell: Cell, result: dict, data: Path) -> None:
        if len(list(data.iterdir())) == 3:
            raise KeyboardInterrupt
        whole(cell, result, data)
    monkeypatch.setattr(measure, "_write", write)
    with pytest.raises(KeyboardInterrupt):
        measure.measure(TREES, tmp_path, workers=workers)
    assert len(list(tmp_path.iterdir())) == 3
    monkeypatch.setattr(measure, "_write", whole)
    asked: list[Cell] = []
    monkeypatch.setattr(sweep, "results", lambda cells, *more: (
        asked.extend(cells), shared(cells, *more))[1])
    measure.measure(TREES, tmp_path, workers=workers)
    assert len(asked) == 3 and len(list(tmp_path.iterdir())) == 6


def _when(folder: Path, cell: Cell) -> dict[str, Any]:
    """Returns the cell's settings and the times at which its run began and ended.

    An untimed cell waits until a second process also runs untimed cells, because a worker that
    was killed needs a while to start again.
    """
    began = time.monotonic()
    if cell in TIMED:
        time.sleep(0.2)
        before = began, time.monotonic()
        with machine.alone():
            began = time.monotonic()
            time.sleep(0.3)
            return {"settings": results.settings(cell), "before": before,
                    "when": (began, time.monotonic())}
    if cell in TREES:
        (folder / str(os.getpid())).touch()
        while len(list(folder.iterdir())) < 2 and time.monotonic() < began + 60:
            time.sleep(0.02)
    time.sleep(0.3)
    return {"settings": results.settings(cell), "when": (began, time.monotonic())}


def test_a_timed_cell_runs_alone_on_its_machine(workers: Workers, tmp_path) -> None:
    workers.client.wait_for_workers(2, timeout=180)  # an earlier test may have killed a worker
    found = dict(sweep.results([*TREES, *TIMED], workers, functools.partial(_when, tmp_path)))
    when = {cell: result["when"] for cell, result in found.items()}
    assert len(when) == 8

    def meet(a: Any, b: Any) -> bool:
        return a != b and when[a][0] < when[b][1] and when[b][0] < when[a][1]
    when.update({("before", cell): found[cell]["before"] for cell in TIMED})
    for timed in TIMED:
        assert not [cell for cell in when if meet(timed, cell)]
        assert all(when[timed][0] >= when[cell][1] for cell in TREES), "a timed cell came first"
    assert any(meet(a, b) for a in TREES for b in TREES), "no cells ran side by side"


def _other_renderer(cell: Cell) -> dict[str, Any]:
    return {"settings": {**results.settings(cell), "renderer": "another"}}


def test_numbers_of_another_renderer_are_refused(workers: Workers) -> None:
    with pytest.raises(rt.Error, match="another renderer"):
        list(sweep.results(TREES[:1], workers, _other_renderer))


def test_a_sweep_sends_its_meshes(tmp_path, monkeypatch) -> None:
    """A machine whose mesh is missing or different uses the mesh that the sweep sends. A machine
    that already has the same files uses its own files."""
    monkeypatch.setattr(own_folder.tempfile, "gettempdir", lambda: str(tmp_path))
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    (tmp_path / "here" / "bunny.ply").write_bytes(b"a mesh")
    (tmp_path / "here" / "cameras.json").write_text("{}")
    monkeypatch.setenv("GPGPU_RT_SCENES", str(tmp_path / "here"))
    files = meshes.mesh_files("bunny")
    assert set(files) == {"bunny.ply", "cameras.json"}
    assert meshes.mesh_files("cornell") == meshes.mesh_files("no such") == {}
    meshes.take_mesh("bunny", files)
    assert os.environ["GPGPU_RT_SCENES"] == str(tmp_path / "here")
    monkeypatch.setenv("GPGPU_RT_SCENES", str(tmp_path / "there"))
    meshes.take_mesh("bunny", files)
    path = catalogue.mesh_path("bunny")
    assert path is not None and path.read_bytes() == b"a mesh"
    assert os.environ["GPGPU_RT_SCENES"].endswith(str(tmp_path / "there"))


def test_the_machines_lock_ends_with_its_process(tmp_path, monkeypatch) -> None:
    """If a process that holds the machine's lock is killed, another process can get the lock."""
    monkeypatch.setattr(own_folder.tempfile, "gettempdir", lambda: str(tmp_path))
    with machine.taken(), machine.alone():
        pass
    killed = subprocess.run([sys.executable, "-c", (
        "import os\nfrom gpgpu_rt.workers.machine import alone\n"
        "with alone(): os.kill(os.getpid(), 9)")], env={**os.environ, "TMPDIR": str(tmp_path)})
    assert killed.returncode == -9
    with machine.alone():
        assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("words, message", [
    (["--scheduler", "tcp://127.0.0.1:1"], "no Dask scheduler answers")])
def test_mistakes_are_one_line(words: list, message: str, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr("gpgpu_rt.workers.workers.PATIENCE", "1s")
    (tmp_path / "data").mkdir()     # otherwise the command adds a line about the new folder
    assert main([*words, "--only", "fig17", "--data", str(tmp_path / "data"), "--out",
                 str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and message in said
