"""Figures 24 and 25 and the table of stream reduction agree with geometry computed directly."""
from __future__ import annotations

import csv

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.figures.diagrams import small_rays
from gpgpu_rt.figures.experiments import reduction
from gpgpu_rt.figures.framework import measure
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.survey import fig24_ray_cones as fig24
from gpgpu_rt.figures.survey import fig25_ray_hierarchy as fig25

WIDE = 1 + 1e-5  # relative tolerance for the cones' margins and for float32 rounding


def test_spheres_and_cones_bound_their_rays() -> None:
    """A node's sphere contains all ray origins below the node, and the node's cone contains all
    directions. Sphere and cone are not much larger than necessary."""
    levels, _, _ = small_rays.traversal()
    origins, directions = (a.astype(float) for a in small_rays.rays())
    assert [len(level.radius) for level in levels] == [64, 16, 4, 1]
    for height, level in enumerate(levels):
        count = 4 ** height
        for node in range(len(level.radius)):
            some = slice(node * count, (node + 1) * count)
            off = np.linalg.norm(origins[some] - level.centre[node], axis=1)
            turn = np.arccos(np.minimum(directions[some] @ level.axis[node], 1))
            assert off.max() <= level.radius[node] * WIDE + 1e-6
            assert level.radius[node] <= 1.5 * off.max() + 1e-6
            assert turn.max() <= level.angle[node] * WIDE + 1e-3
            assert level.angle[node] <= 2 * turn.max() + 1e-3
    assert len(fig24.rows()) == 21


def test_each_stream_has_the_pairs_that_the_reduction_kept() -> None:
    _, rounds, hits = small_rays.traversal()
    assert [one.level for one in rounds] == [3, 2, 1]
    assert (rounds[0].pairs[:, 0] == np.arange(small_rays.TRIANGLES)).all()
    for one, after in zip(rounds, rounds[1:]):
        slots = one.slots.reshape(-1, 2)
        assert (after.pairs == slots[slots[:, 0] >= 0]).all()
        assert 0 < one.kept < slots.shape[0]
    for one in rounds:  # a filled slot has the pair's triangle and a child of the pair's node
        there = one.slots[..., 0] >= 0
        assert (one.slots[..., 0] == one.pairs[:, :1])[there].all()
        assert (one.slots[..., 1] == 4 * one.pairs[:, 1:] + np.arange(4))[there].all()
    assert rounds[-1].kept == hits.triangles_tested.sum()


def test_no_pair_with_a_hit_is_missing_in_the_stream() -> None:
    _, rounds, hits = small_rays.traversal()
    truth = rt.reference.trace(small_rays.scene(), *small_rays.rays())
    assert (hits.triangle == truth.triangle).all() and truth.hit.sum() > 10
    at = rounds[-1].slots.reshape(-1, 2)
    pairs = set(map(tuple, at[at[:, 0] >= 0].tolist()))
    assert {(int(truth.triangle[ray]), ray) for ray in np.flatnonzero(truth.hit)} <= pairs


@pytest.mark.parametrize("figure", [fig24, fig25], ids=["fig24", "fig25"])
def test_figures_are_drawn(figure, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(fig25, "SCENE", "cornell")
    figure.draw(tmp_path, tmp_path, False)
    name = figure.__name__.split(".")[-1].split("_")[0]
    assert (tmp_path / f"{name}.png").stat().st_size > 20_000
    assert (tmp_path / f"{name}.md").read_text().startswith("# Figure 2")
    with (tmp_path / f"{name}.csv").open() as file:
        assert len(list(csv.reader(file))) > 3


def test_reduction_is_measured_and_drawn(tmp_path, monkeypatch) -> None:
    cells = [Cell("streams", "blocks", (("kept", kept),), 40, "reduction", 1)
             for kept in (0.25, 1.0)]
    monkeypatch.setattr(reduction, "cells", lambda full: cells)
    measure.measure(cells, tmp_path)
    reduction.draw(tmp_path, tmp_path, False)
    with (tmp_path / "reduction.csv").open() as file:
        rows = list(csv.reader(file))
    assert tuple(rows[0]) == reduction.HEADS and [row[1] for row in rows[1:]] == ["0.25", "1.0"]
    assert all(float(number) > 0 for row in rows[1:] for number in row)
    assert (tmp_path / "reduction.png").stat().st_size > 10_000
