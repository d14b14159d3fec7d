"""Whatever a command prints, writes or draws of a stand-in says that it is one."""
from __future__ import annotations

import argparse
import json

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.cli.main import _parser
from gpgpu_rt.rays import random_rays

SCENE = "shirley6"
METHOD = ("-m", "bvh-threaded")
# Words of each command that takes a scene; OUT is a path that it writes to.
COMMANDS = {
    "render": (*METHOD, "--size", "8x8", "-o", "OUT.png"),
    "trace": ("RAYS.npz", *METHOD, "-o", "OUT.npz"),
    "bench": (*METHOD, "--size", "8", "--runs", "1"),
    "passes": (*METHOD, "--size", "8x8", "-o", "OUT"),
    "heat": (*METHOD, "--size", "8x8", "-o", "OUT.png"),
    "accuracy": (*METHOD, "--rays", "64", "--size", "8x8", "--precisions", "fp32"),
    "tune": (*METHOD, "--rays", "64", "--budget", "0", "--max-wrong", "0.5", "--max-t-error", "1",
             "-o", "OUT.json"),
}
# A window tells in its panel; no stand-in is the one surface that can be remeshed.
APART = {"view", "remesh"}


def with_a_scene() -> set[str]:
    parser = _parser()
    commands = next(action for action in parser._actions
                    if isinstance(action, argparse._SubParsersAction)).choices
    return {name for name, sub in commands.items()
            if any(action.dest in ("scene", "scenes") and not action.option_strings
                   for action in sub._actions)}


def test_no_command_is_left_out() -> None:
    assert with_a_scene() - APART == set(COMMANDS)


@pytest.fixture
def words(tmp_path, monkeypatch):
    monkeypatch.setenv("GPGPU_RT_SCENES", "")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "cache"))
    origins, directions = random_rays(rt.load_scene("cornell"), 8, 1)
    np.savez(tmp_path / "RAYS.npz", origins=origins, directions=directions)
    return lambda command: (command, SCENE, *COMMANDS[command])


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_tell(command: str, words, capsys) -> None:
    assert cli.main(words(command)) == 0
    assert f"{SCENE} is a procedural stand-in for" in capsys.readouterr().out
    assert cli.main((*words(command), "--json")) == 0
    found = json.loads(capsys.readouterr().out)
    found = found["races"][0] if command == "bench" else found
    assert found["stand_in"] == rt.load_scene(SCENE).stand_in


def test_titles_tell(monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_SCENES", "")
    assert rt.load_scene(SCENE).title == f"{SCENE} (a stand-in)"
    assert rt.load_scene("cornell").title == "cornell"
