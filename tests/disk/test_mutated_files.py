"""Reading a mutated file either succeeds or fails with an error of one line. The quick suite
tries at most 30 files of each kind, and the full suite 10,000."""
from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools"
KINDS = ("mesh", "material", "scene", "rays", "settings", "animation", "cameras", "cache",
         "resume")
FULL = 10_000


@pytest.fixture
def tool(monkeypatch):
    monkeypatch.syspath_prepend(TOOLS)
    return importlib.import_module("mutate_files")


@pytest.mark.parametrize("kind", KINDS)
def test_a_sample_ends_in_success_or_a_line(kind: str, tool, tmp_path: Path) -> None:
    ends = {}
    for seed in range(1, 9 if kind == "cache" else 31):
        folder = tmp_path / str(seed)
        folder.mkdir()
        ends[seed] = tool.run_case(kind, seed, folder)
    wrong = {seed: end for seed, end in ends.items() if end not in (tool.OK, tool.REFUSED)}
    assert not wrong
    assert tool.OK in ends.values(), "every file is refused, perhaps by the first check"
    assert tool.REFUSED in ends.values() or kind in ("cache", "resume")


def test_the_list_of_kinds_is_complete(tool) -> None:
    assert set(importlib.import_module("mutating.file_kinds").KINDS) == set(KINDS)


def test_a_case_follows_from_its_seed(tool, tmp_path: Path) -> None:
    write = importlib.import_module("mutating.file_kinds").write_case
    found = []
    for name in ("one", "again"):
        (tmp_path / name).mkdir()
        write("mesh", 7, tmp_path / name)
        found.append({path.name: path.read_bytes() for path in (tmp_path / name).iterdir()})
    assert found[0] == found[1]


def test_exceptions_and_hangs_are_reported(tool, tmp_path: Path, monkeypatch) -> None:
    def read(kind: str, seed: int, folder: Path) -> None:
        if seed == 1:
            raise TypeError("of our own")
        while True:
            pass
    monkeypatch.setattr(importlib.import_module("mutating.file_kinds"), "read_case", read)
    monkeypatch.setattr(tool, "SECONDS", 1)
    assert tool.run_case("mesh", 1, tmp_path) == "TypeError: of our own"
    assert tool.run_case("mesh", 2, tmp_path) == "takes more than 1 s"


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_end_in_success_or_a_line(kind: str) -> None:
    answer = subprocess.run([sys.executable, TOOLS / "mutate_files.py", kind, str(FULL), "0"],
                            capture_output=True, text=True)
    assert answer.returncode == 0, answer.stdout[-4000:] + answer.stderr[-2000:]
    found = json.loads(answer.stdout.splitlines()[-1])
    assert found["success"] + found.get("one line", 0) == FULL
