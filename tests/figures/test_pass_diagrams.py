"""Tests of Figures 6 and 23, which draw logged passes, and of ray coherence, which is measured by
the nodes that rays must visit."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import soup_scene

import gpgpu_rt as rt
from gpgpu_rt.figures.diagrams.issued_passes import kinds_of
from gpgpu_rt.figures.experiments import coherence
from gpgpu_rt.figures.survey import fig06_grid_streams as fig06
from gpgpu_rt.figures.survey import fig23_ray_tiles as fig23


def test_figure_6_has_purcells_kernels() -> None:
    kinds = kinds_of(fig06.passes())
    assert list(kinds) == ["eye_rays", "init", "traverse", "intersect", "surfaces", "picture"]
    assert set(fig06.WORDS) == set(kinds)
    assert kinds["init"][1] == 2  # eye rays, shadow rays
    assert {"rays", "state", "hit", "grid_cell table"} == set(kinds["traverse"][0].reads)
    assert {"triangle table", "reference table"} <= set(kinds["intersect"][0].reads)
    assert set(kinds["surfaces"][0].writes) == {"rays", "lit", "direct"}


def test_figure_23_shows_the_order_and_the_rejected_pairs() -> None:
    """Figure 23 shows the passes in order. The cones reject most pairs of triangle and tile."""
    log, batches = fig23.passes()
    kernels = [one.kernel for one in log]
    assert kernels[:4] == ["tile_spans", "tile_cones", "tile_ends", "tile_pairs"]
    assert kernels[-2:] == ["tile_pairs, again", "tile_hits"]
    kinds = kinds_of(log)
    assert set(fig23.WORDS) == set(kinds) and kinds["tile_pairs"][1] == len(batches)
    assert "nearest" not in kinds["tile_pairs"][0].reads and kinds["tile_pairs"][0].writes == (
        "nearest",)
    assert "nearest" in kinds["tile_pairs, again"][0].reads
    scene = rt.load_scene(fig23.SCENE)
    assert sum(pairs for pairs, _ in batches) == len(scene) * (fig23.SIDE // fig23.TILE) ** 2
    assert 0 < sum(through for _, through in batches) < 0.1 * sum(pairs for pairs, _ in batches)


@pytest.mark.parametrize("figure", [fig06, fig23])
def test_figures_6_and_23_are_drawn(tmp_path: Path, figure) -> None:
    figure.draw(tmp_path, tmp_path, False)
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize("seed", [5], ids="seed{}".format)
def test_needed_nodes(seed: int) -> None:
    """`needed_nodes` finds the same nodes as a test of each ray against every box of the tree."""
    scene = soup_scene(60, seed)
    rng = np.random.default_rng(seed)
    origins, directions = rng.random((40, 3)), rng.normal(size=(40, 3))
    with rt.Tracer(scene, "bvh-threaded") as tracer:
        t = tracer.trace(origins, directions).t
        bvh = tracer.accelerator.structure
    rays, nodes = coherence.needed_nodes(bvh, origins, directions, t)
    found = set(zip(rays.tolist(), nodes.tolist()))
    assert len(found) == len(rays)
    for ray in range(40):
        ends = np.sort([(bvh.lo - origins[ray]) / directions[ray],
                        (bvh.hi - origins[ray]) / directions[ray]], axis=0)
        enters, leaves = ends[0].max(1), ends[1].min(1)
        wanted = (enters <= leaves) & (leaves >= 0) & (enters <= t[ray])
        assert {node for r, node in found if r == ray} == set(np.flatnonzero(wanted).tolist())
    tiles = np.arange(40) // 20
    by_hand = [len({node for r, node in found if tiles[r] == tile}) for tile in (0, 1)]
    assert coherence.distinct_nodes(rays, nodes, tiles) == np.mean(by_hand)


def test_tiles() -> None:
    """A tile is a block of 8x8 pixels of an image, or 64 consecutive rays of an order."""
    image = coherence.tiles_of_image(20).reshape(20, 20)
    assert image[0, 7] == image[7, 0] == 0 and image[0, 8] == 1 and image[19, 19] == 8
    order = np.random.default_rng(1).permutation(200)
    assert (coherence.tiles_of_order(order)[order] == np.arange(200) // 64).all()
    steps = np.array([1, 3, 2, 2])
    assert coherence.divergence(steps, np.array([0, 0, 1, 1])) == (3 + 3 + 2 + 2) / 8
