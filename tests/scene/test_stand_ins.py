"""Commands mark a stand-in scene, which is a procedural substitute for a paper's scene. The mark
is in the printed text and JSON, and in the titles of charts, heat maps, pages and films."""
from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.cli import benching
from gpgpu_rt.cli import passes_heat as looking
from gpgpu_rt.cli.main import command_parser
from gpgpu_rt.inspect import false_colours as colours
from gpgpu_rt.rays.ray_sets import random_rays
from gpgpu_rt.report.films import film, heat_maps

SCENE = "shirley6"
TITLE = f"{SCENE} (stand-in)"
METHOD = ("-m", "bvh-threaded")
# Arguments of each command that needs a scene. The files lie in the test's own folder: OUT* is the
# output, and RAYS.npz is a file of rays, which the fixture writes.
COMMANDS = {
    "render": (*METHOD, "--size", "8x8", "-o", "OUT.png"),
    "trace": ("RAYS.npz", *METHOD, "-o", "OUT.npz"),
    "bench": (*METHOD, "--size", "8", "--runs", "1"),
    "passes": (*METHOD, "--size", "8x8", "-o", "OUT"),
    "heat": (*METHOD, "--size", "8x8", "-o", "OUT.png"),
    "accuracy": (*METHOD, "--rays", "64", "--size", "8x8", "--precisions", "fp32"),
    "tune": (*METHOD, "--rays", "64", "--budget", "0", "--max-wrong", "0.5", "--max-t-error", "1",
             "-o", "OUT.json"),
    "web": (*METHOD, "-o", "OUT.html"),
}
# Commands that are not tested here. The viewer's panel shows the mark. `remesh` needs a single
# surface, which SCENE is not.
APART = {"view", "remesh"}


def with_a_scene() -> set[str]:
    """Return the names of the commands that have a scene as an argument."""
    parser = command_parser()
    commands = next(action for action in parser._actions
                    if isinstance(action, argparse._SubParsersAction)).choices
    return {name for name, sub in commands.items()
            if any(action.dest in ("scene", "scenes") and not action.option_strings
                   for action in sub._actions)}


def test_no_command_is_left_out() -> None:
    assert with_a_scene() - APART == set(COMMANDS)


@pytest.fixture
def words(tmp_path, monkeypatch):
    """Return a function that gives the command line of a command for the stand-in scene."""
    monkeypatch.setenv("GPGPU_RT_SCENES", "")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "cache"))
    origins, directions = random_rays(rt.load_scene("cornell"), 8, 1)
    np.savez(tmp_path / "RAYS.npz", origins=origins, directions=directions)
    return lambda command: (command, SCENE, *COMMANDS[command])


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_tell(command: str, words, capsys) -> None:
    """The text and the JSON of each command say that the scene is a stand-in. With --json, a line
    on stderr also says this."""
    assert cli.main(words(command)) == 0
    assert f"{SCENE} is a procedural stand-in for" in capsys.readouterr().out
    assert cli.main((*words(command), "--json")) == 0
    out, err = capsys.readouterr()
    assert f"{SCENE} is a procedural stand-in for" in err
    found = json.loads(out)
    found = found["races"][0] if command == "bench" else found
    assert found["stand_in"] == rt.load_scene(SCENE).stand_in


def test_pictures_tell(words, monkeypatch) -> None:
    """The charts of `bench`, the pictures of `heat` and `passes`, the page of `web`, and the films
    and heat maps of `report` show the title that marks a stand-in."""
    drawn: list[str] = []

    def note(*title: object) -> None:
        drawn.append(str(title))
    monkeypatch.setattr(benching, "_chart", lambda path: lambda found, *_: note(found[0][0]))
    for module, name, place in ((looking, "draw_heat", 2), (colours, "sheet", 1)):
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *a, real=real, place=place: (
            note(a[place]), real(*a))[1])
    for command, more in (("bench", ("--plot", "chart.png")), ("heat", ()), ("passes", ())):
        drawn.clear()
        assert cli.main((*words(command), *more)) == 0
        assert drawn and all(TITLE in title for title in drawn), command
    assert cli.main(words("web")) == 0
    assert TITLE in Path("OUT.html").read_text().partition("</title>")[0]
    assert TITLE in film(rt.load_scene(SCENE), "kd-restart", (8, 8))
    assert TITLE in heat_maps(rt.load_scene(SCENE), ["kd-restart"], (8, 8))


def test_titles_tell(words) -> None:
    """Only the title of a stand-in scene is marked."""
    assert rt.load_scene(SCENE).title == TITLE
    assert rt.load_scene("cornell").title == "cornell"
