"""The examples run as a user runs them, and a tool that is asked for help only prints help."""
from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli

EXAMPLES = Path(rt.__file__).parents[1] / "examples"
TOOLS = Path(rt.__file__).parents[1] / "tools"
RUNS = {
    "render": (["cornell", "box.png", "24"], r"box.png: 32 triangles, .* nodes per eye ray"),
    "compare_methods": (["cornell", "kd-restart", "grid"], r"grid +\S+ +\S+ +0 +0\n"),
    "add_a_method": (["cornell", "24"], r"(sweep along \w: .* 100.00% .*\n){3}"),
}


def test_every_example_is_run() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(RUNS)


@pytest.mark.parametrize("name", RUNS)
def test_example(exact_renderer, tmp_path: Path, name: str) -> None:
    arguments, said = RUNS[name]
    answer = subprocess.run([sys.executable, str(EXAMPLES / f"{name}.py"), *arguments],
                            capture_output=True, text=True, cwd=tmp_path)
    assert answer.returncode == 0, answer.stderr
    assert re.search(said, answer.stdout), answer.stdout
    if name == "render":
        with Image.open(tmp_path / "box.png") as image:
            assert image.size == (24, 24)


@pytest.mark.parametrize("path", sorted(TOOLS.glob("*.py")), ids=lambda path: path.name)
def test_a_tool_asked_for_help_runs_nothing(path: Path) -> None:
    answer = subprocess.run([sys.executable, str(path), "--help"], capture_output=True, text=True,
                            timeout=20)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.startswith(f"usage: {path.name}")


def test_the_scene_file_is_the_one_of_its_page(tmp_path: Path) -> None:
    page = (EXAMPLES.parent / "docs" / "scene-files.md").read_text()
    shown = page.partition("```json\n")[2].partition("```")[0]
    assert json.loads((EXAMPLES / "still.json").read_text()) == json.loads(shown)
    assert cli.main(["render", str(EXAMPLES / "still.json"), "--size", "24x18", "-o",
                     str(tmp_path / "still.png")]) == 0
    with Image.open(tmp_path / "still.png") as image:
        assert len(image.getcolors()) > 50
