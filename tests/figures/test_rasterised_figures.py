"""Tests of the figures on approximations by rasterisation: their scenes, and their pages from
small measurements."""
from __future__ import annotations

import csv

import numpy as np
import pytest

from gpgpu_rt.figures.experiments import bundle_errors, caustic_errors, caustics, ray_bundles
from gpgpu_rt.figures.framework import measure
from gpgpu_rt.figures.framework.cell import Cell


def test_the_lamp_hangs_under_a_closed_ceiling() -> None:
    """In the first scene, the lamp fills a hole of the ceiling. In the second scene, the ceiling
    is closed, and the lamp is 0.5 below the ceiling."""
    let_in, hung = map(bundle_errors.scene_of, ray_bundles.SCENES)
    for scene, lamp_below, ceiling in ((let_in, 0, 556 * 559.2 - 130 * 105),
                                       (hung, 0.5, 556 * 559.2)):
        corners = scene.triangles.astype(np.float64)
        high = corners[..., 1].max()
        v0, v1, v2 = corners.transpose(1, 0, 2)
        area = np.linalg.norm(np.cross(v1 - v0, v2 - v0), axis=1) / 2
        lamp = np.isin(np.arange(len(scene)), scene.emitters)
        assert lamp.sum() == 2 and area[lamp].sum() == pytest.approx(130 * 105)
        assert high - corners[lamp][..., 1] == pytest.approx(lamp_below, abs=1e-4)
        above = (corners[..., 1] == high).all(axis=1) & ~lamp
        assert area[above].sum() == pytest.approx(ceiling, rel=1e-5)
    assert hung.materials == let_in.materials


@pytest.mark.parametrize("name", [name for name in caustic_errors.SCENES if "bunny" not in name])
def test_each_caustic_scene_has_a_mirror_or_a_refractor(name: str) -> None:
    """The mirrors or refracting surfaces lie above the floor. Each scene also has other
    surfaces."""
    scene = caustic_errors.scene_of(name)
    turns = np.array([bool(m.ior) or any(m.mirror) for m in scene.materials])[scene.material_of]
    assert turns.any() and not turns.all() and scene.triangles[turns][..., 1].min() >= 0


@pytest.mark.full
@pytest.mark.parametrize("page, cell", [
    (caustics, Cell("water", "bvh-threaded", (), 24, "caustics", 1)),
    (ray_bundles, Cell("cornell-light", "bvh-threaded", (
        ("patch", 0.3), ("directions", 8), ("between", 8), ("resolutions", (16, 32)),
        ("samples", 8)), 12, "ray bundles", 1))], ids=["caustics", "ray_bundles"])
def test_pages(tmp_path, monkeypatch, page, cell: Cell) -> None:
    monkeypatch.setattr(caustic_errors, "PHOTONS", 48)
    monkeypatch.setattr(page, "cells", lambda full: [cell])
    measure.measure([cell], tmp_path)
    page.draw(tmp_path, tmp_path, False)
    name = page.__name__.rpartition(".")[2]
    with (tmp_path / f"{name}.csv").open() as file:
        heads, *rows = csv.reader(file)
    assert tuple(heads) == page.HEADS and rows and all(row[0] == cell.scene for row in rows)
    assert all(float(value) == float(value) for row in rows for value in row[1:])
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert f"| {cell.scene} |" in (tmp_path / f"{name}.md").read_text()
