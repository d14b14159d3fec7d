"""The full figures stopped at Soda Hall: its kd-tree has 24 million nodes, floats number 2^24. Its
smallest subtrees become leaves now, as a BVH's do."""
from __future__ import annotations

import pytest
from conftest import RAY_SETS, assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.accel import kdtree


@pytest.mark.parametrize("method", ["kd-restart", "kd-ropes", "kd-backtrack", "kd-packet"])
def test_more_kd_nodes_than_can_be_indexed(exact_renderer, method: str, monkeypatch) -> None:
    scene = soup_scene(300, 4)
    rays = RAY_SETS["random"](scene, 800, 5)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    monkeypatch.setattr(kdtree, "EXACT_INTEGER", 2000)
    with rt.Tracer(scene, method) as tracer:
        tree = tracer.accelerator.structure
        assert 300 < len(tree.axis) <= 2000 and 1000 < len(tree.references) <= 2000
        assert_same_bits(tracer.trace(*rays), expected)
