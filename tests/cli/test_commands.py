"""Tests of the times that --timings prints, and of `MODULES`. `MODULES` names the module of each
command, so that a command imports only the modules that it needs."""
from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time

import pytest

from gpgpu_rt.cli.main import MODULES, command_parser, main
from gpgpu_rt.cli.timings import since_start


def commands(parser: argparse.ArgumentParser) -> list[str]:
    return list(next(action for action in parser._actions
                     if isinstance(action, argparse._SubParsersAction)).choices)


def test_the_table_has_every_command() -> None:
    assert commands(command_parser()) == list(MODULES)


@pytest.mark.parametrize("name", MODULES)
def test_a_command_is_in_its_module(name: str) -> None:
    assert commands(command_parser(name)) == [other for other in MODULES
                                              if MODULES[other] == MODULES[name]]


def test_a_command_imports_no_other_command() -> None:
    told = ("import sys; from gpgpu_rt.cli import main; main(['methods']); "
            "print(*(name for name in sys.modules if name.startswith('gpgpu_rt.cli.')))")
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    loaded = {name.rpartition(".")[2] for name in done.stdout.splitlines()[-1].split()}
    assert "listing" in loaded and not loaded & (set(MODULES.values()) - {"listing", "program"})


def test_timings_cover_the_whole_process(tmp_path, capsys) -> None:
    words = ["render", "cornell", "-m", "grid", "--size", "8x8", "-o", str(tmp_path / "a.png")]
    assert main([*words, "--timings"]) == 0
    parts = [line.split("  ")[0] for line in capsys.readouterr().out.splitlines()]
    assert parts[-9:] == ["start and imports", "context", "scene", "structure", "tracer", "passes",
                          "other drawing", "file", "sum"]
    assert main([*words, "--timings", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told["timings"]) == set(parts[-9:-1]) and min(told["timings"].values()) >= 0
    assert told["timings"]["start and imports"] <= since_start()
    assert main([*words, "--timings", "--frames", "2"]) == 1


def test_the_start_of_the_process_is_known() -> None:
    told = "import time; time.sleep(0.3); from gpgpu_rt.cli.timings import since_start as s; " \
           "print(s())"
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    assert 0.3 <= float(done.stdout) <= time.perf_counter() - began + 0.05
