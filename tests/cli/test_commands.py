"""Commands: the table of modules, which lets a command import only its own module."""
from __future__ import annotations

import argparse
import subprocess
import sys

import pytest

from gpgpu_rt.cli.main import MODULES, _parser


def commands(parser: argparse.ArgumentParser) -> list[str]:
    return list(next(action for action in parser._actions
                     if isinstance(action, argparse._SubParsersAction)).choices)


def test_the_table_has_every_command() -> None:
    assert commands(_parser()) == list(MODULES)


@pytest.mark.parametrize("name", MODULES)
def test_a_command_is_in_its_module(name: str) -> None:
    assert commands(_parser(name)) == [other for other in MODULES
                                       if MODULES[other] == MODULES[name]]


def test_a_command_imports_no_other_command() -> None:
    told = ("import sys; from gpgpu_rt.cli import main; main(['methods']); "
            "print(*(name for name in sys.modules if name.startswith('gpgpu_rt.cli.')))")
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    loaded = {name.rpartition(".")[2] for name in done.stdout.splitlines()[-1].split()}
    assert "listing" in loaded and not loaded & (set(MODULES.values()) - {"listing", "program"})
