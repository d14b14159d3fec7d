"""Tests ``gpgpu-rt render`` for a scene with materials: its options, its plan, and its messages
for users' mistakes."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gpgpu_rt import cli

SCENE = {"materials": {"glass": {"ior": 1.5}},
         "meshes": [{"box": {"lo": [0, 0, 0], "hi": [1, 1, 1]}, "material": "glass"}],
         "environment": {"zenith": [0, 0, 1], "ground": [1, 0, 0]}}


@pytest.fixture
def render(tmp_path: Path):
    (tmp_path / "still.json").write_text(json.dumps(SCENE))

    def run(*words: str) -> int:
        return cli.main(["render", str(tmp_path / "still.json"), "--size", "16x12", "-o",
                         str(tmp_path / "out.png"), *words])
    run.out = tmp_path / "out.png"
    return run


def test_the_plan_is_printed_before_drawing(render, capsys) -> None:
    assert render("--explain") == 0
    words = capsys.readouterr().out
    assert words.index("refract") < words.index("wrote ")
    # In the list of what is left out, the reason comes before the names.
    assert "no material has a texture: texture corner_uv" in words
    assert np.ptp(np.asarray(Image.open(render.out))) > 0


def test_the_plan_is_in_the_json(render, capsys) -> None:
    assert render("--explain", "--json", "--bounces", "2") == 0
    said = json.loads(capsys.readouterr().out)
    assert said["plan"]["needs"]["bounces"] == 2 and "DIELECTRICS" in said["plan"]["defines"]
    assert said["plan"]["texture_bytes"] == said["statistics"]["texture_bytes"]
    assert said["plan"]["left_out"]["define"]["MIRRORS"] == "no material is a mirror"
    assert said["statistics"]["picture_passes"]["refract"] >= 1


def test_direct_and_all_features(render, capsys) -> None:
    assert render() == 0
    first = np.asarray(Image.open(render.out))
    assert render("--all-features") == 0
    assert (np.asarray(Image.open(render.out)) == first).all()
    assert render("--integrator", "direct") == 0
    assert (np.asarray(Image.open(render.out)) != first).any()


@pytest.mark.parametrize("words, message", [
    (("--integrator", "whited"), "no integrator 'whited'; did you mean whitted"),
    (("--integrator", "direct", "--bounces", "3"), "integrator direct has no option --bounces"),
    (("--bounces", "-1"), "option bounces=-1 must be at least 0"),
    (("--light-samples", "many"), "option light_samples='many' must be int")])
def test_mistakes_are_one_line(render, capsys, words: tuple[str, ...], message: str) -> None:
    assert render(*words) == 1
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1 and not render.out.exists()
