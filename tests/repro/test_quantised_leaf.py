"""In the past, quantised nodes failed for a tree of a single leaf. Such a tree has no pair of
children, so the table of pairs was empty, and packing an empty table failed."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt

METHODS = [row.name for row in rt.methods()
           if any(option.name == "quantise_nodes" for option in row.options)]


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("method", METHODS)
def test_one_triangle_under_quantised_nodes(method: str, bits: int) -> None:
    scene = rt.Scene.from_arrays(np.eye(3), [[0, 1, 2]])
    with rt.Tracer(scene, method, quantise_nodes=bits) as tracer:
        hits = tracer.trace([[0, 0, 0], [0, 0, 0]], [[1, 1, 1], [-1, -1, -1]])
    assert hits.triangle.tolist() == [0, -1]
    assert hits.t[0] == pytest.approx(1 / 3)
