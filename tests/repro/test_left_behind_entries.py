"""With entry points, rays that a packet leaves unfinished continue as single rays from the root.

In the past, the program for these single rays did not compile, because nothing built entry lists
for single rays.
"""
from __future__ import annotations

import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt

CASES = [(row.name, tile) for row in rt.methods() if row.packet for option in row.options
         if option.name == "entry_points" for tile in option.choices]


@pytest.mark.parametrize("octants", [False, True], ids=["stack", "octants"])
@pytest.mark.parametrize("method, tile", CASES)
def test_single_rays_begin_at_the_root(monkeypatch: pytest.MonkeyPatch, precise_renderer,
                                       method: str, tile: int, octants: bool) -> None:
    monkeypatch.setattr("gpgpu_rt.traversal.packets.PACKET_STEPS", 12)
    scene = soup_scene(300, 3)
    rays = scene.camera.rays((32, 32))
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    with rt.Tracer(scene, method, octants=octants, entry_points=tile) as tracer:
        hits = tracer.trace(*rays)
        # `single` is set only if some rays continued as single rays.
        assert tracer.session.driver.driver.kept.get("single") is not None
        hidden = tracer.occluded(*rays)
    assert_same_bits(hits, expected)
    assert (hidden == expected.hit).all()
