"""The figure `needs`: a renderer with only the features that a scene requires draws the same
picture as the renderer with all features. The smaller renderer uses no more bytes or passes, and
the page shows the measured numbers."""
from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import gpgpu_rt as rt
from gpgpu_rt.figures.experiments import needs, needs_times
from gpgpu_rt.figures.experiments.growing import FLOOR, STEPS, scenes
from gpgpu_rt.figures.framework import measure
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.survey import fig01_effects as fig01
from gpgpu_rt.figures.survey import fig07_proximity_clouds as fig07
from gpgpu_rt.render.needs import Asked, SceneNeeds
from gpgpu_rt.scene.light import BACKDROP


@pytest.mark.parametrize("step", range(len(STEPS)))
def test_derived_features_suffice_and_cost_no_more(exact_renderer, step: int) -> None:
    """With only the features that a scene requires, a renderer draws the same picture as with all
    features, and uses no more bytes or passes."""
    found = needs_times.measure(step, "bvh-threaded", 24, 1, "tenk")
    one, other = found["derived"], found["all"]
    assert not found["differing"]
    assert all(one[count] <= other[count] for count in needs_times.COUNTS)
    for name, drawn in one["passes_by_name"].items():
        assert drawn <= other["passes_by_name"][name]
    if not step:
        assert one["texture_bytes"] <= other["texture_bytes"] / 2


def test_each_step_needs_other_and_no_fewer_features() -> None:
    present = [SceneNeeds.of(scene, Asked(4, 4)).present for scene in scenes("tenk")]
    assert len(present) == len(STEPS) == len(set(present))
    assert all(len(a) <= len(b) for a, b in zip(present, present[1:]))


def test_every_part_of_a_scene_is_in_its_digest(monkeypatch) -> None:
    """A kept measurement is stale if any part of its scene has changed."""
    scene = scenes("tenk")[-1]
    *rest, glass = scene.materials
    checks = scene.materials[FLOOR].texture
    around = scene.environment.image
    darker = replace(scene.environment, image=rt.Texture(around.name, around.texels / 2))
    changed = [scene, replace(scene, environment=BACKDROP), replace(scene, uv=scene.uv / 2),
               replace(scene, environment=darker), replace(scene, lights=scene.lights[1:]),
               replace(scene, materials=(*rest, replace(glass, ior=1.4))),
               replace(scene, colours=scene.colours / 2),
               replace(scene, materials=tuple(
                   replace(one, texture=rt.Texture(checks.name, checks.texels / 2))
                   if one.texture is checks else one for one in scene.materials))]
    monkeypatch.setattr(needs_times, "scenes", lambda name: changed)
    assert len({needs_times.digest("tenk", at) for at in range(len(changed))}) == len(changed)


def test_the_page_shows_the_measured_steps(tmp_path: Path, monkeypatch) -> None:
    small = [Cell("tenk", needs.METHOD, (("step", step),), 8, "needs", 1) for step in (0, 1)]
    monkeypatch.setattr(needs, "cells", lambda full: small)
    monkeypatch.setattr(needs, "SCENE", "tenk")
    measure.measure(small, tmp_path)
    needs.draw(tmp_path, tmp_path, False)
    with (tmp_path / "needs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["scene"] for row in rows] == list(STEPS[:2])
    assert STEPS[1] in (tmp_path / "needs.md").read_text()
    assert (tmp_path / "needs.png").stat().st_size > 10_000


@pytest.mark.parametrize("module", [fig01, fig07], ids=["fig01", "fig07"])
def test_lit_pictures_are_drawn_with_rays_and_seconds(module, tmp_path: Path, monkeypatch) -> None:
    """The CSV file of a lit picture has the picture's number of rays and seconds."""
    def tiny(*asked: Any, **more: int) -> Cell:
        *_, method, _ = asked
        return Cell("cornell-light", method, (), 12, "picture", runs=1)
    monkeypatch.setattr(module, "cell", tiny)
    measure.measure(dict.fromkeys(module.cells(False)), tmp_path)
    module.draw(tmp_path, tmp_path, False)
    name = module.__name__.rpartition(".")[2].split("_")[0]
    with (tmp_path / f"{name}.csv").open() as file:
        row = next(csv.DictReader(file))
    assert int(row["rays traced"]) == 17 * 12 * 12 and float(row["s"]) > 0
    assert (tmp_path / f"{name}.png").stat().st_size > 5_000
