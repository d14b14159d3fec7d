"""Hits keep the image shape of their rays, and their arrays stay flat."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.methods import methods


@pytest.mark.parametrize("method", [row.name for row in methods()])
def test_hits_of_an_image_are_an_image(method: str) -> None:
    origins, directions = rt.load_scene("cornell").camera.rays((6, 4))
    origins, directions = origins.reshape(4, 6, 3), directions.reshape(4, 6, 3)
    with rt.Tracer("cornell", method) as tracer:
        hits = tracer.trace(origins, directions)
        flat = tracer.trace(origins.reshape(-1, 3), directions.reshape(-1, 3))
        given = tracer.trace(origins.reshape(-1, 3), directions.reshape(-1, 3), shape=(4, 6))
        everything = tracer.trace_all(origins, directions, max_hits=1)
    assert (hits.shape, flat.shape, given.shape) == ((4, 6), (24,), (4, 6))
    assert hits.t.shape == (24,) and hits.image("t").shape == (4, 6)
    for name in ("t", "u", "v", "triangle", "status", "hit"):
        assert (hits.image(name) == getattr(hits, name).reshape(4, 6)).all(), name
        assert flat.image(name).shape == (24,)
    assert "shape" not in hits.to_dict()
    assert everything.shape == everything.image("count").shape == (4, 6)
    assert (everything.image("count").ravel() == everything.count).all()


@pytest.mark.parametrize("accelerated", [False, True])
def test_the_reference_keeps_the_shape(accelerated: bool) -> None:
    scene = rt.load_scene("cornell")
    origins, directions = (rays.reshape(4, 6, 3) for rays in scene.camera.rays((6, 4)))
    hits = rt.reference.trace(scene, origins, directions, accelerated=accelerated)
    assert hits.image("t").shape == hits.shape == (4, 6)
    assert rt.reference.trace(scene, origins[0], directions[0]).shape == (6,)
    settled, _ = rt.reference.nearest.settle(scene, origins, directions, hits)
    assert settled.shape == (4, 6)


@pytest.mark.parametrize("name", ["T", "shape", "image", "nodes_visited", 5])
def test_a_name_of_no_array_is_refused(name: object) -> None:
    with rt.Tracer("cornell") as tracer:
        hits = tracer.trace(np.zeros((2, 3)), np.ones((2, 3)))
        everything = tracer.trace_all(np.zeros((2, 3)), np.ones((2, 3)))
    for found in (hits, everything):
        with pytest.raises(rt.OptionError, match=f"{name!r}"):
            found.image(name)


@pytest.mark.parametrize("shape", [(0, 5), (0,)])
def test_an_empty_batch_keeps_its_shape(shape: tuple[int, ...]) -> None:
    rays = np.zeros((*shape, 3)), np.ones((*shape, 3))
    with rt.Tracer("cornell") as tracer:
        assert tracer.trace(*rays).image("t").shape == shape
