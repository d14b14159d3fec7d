"""A region that is drawn alone equals the same part of the whole picture, bit for bit."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.scene.region import Region

SIZE = (37, 29)
PICTURES = {
    "direct": dict(integrator="direct"),
    "whitted": dict(integrator="whitted", light_samples=2),
    "whitted, samples": dict(integrator="whitted", samples=3, light_samples=2),
    "path": dict(integrator="path", samples=6),
    "path, random": dict(integrator="path", samples=3, sampler="random")}


@pytest.mark.parametrize("scene, method", [
    ("cornell-light", "bvh-packet"), ("glass-teapot", "bvh-threaded"), ("cornell", "kd-restart")])
@pytest.mark.parametrize("asked", PICTURES.values(), ids=PICTURES)
def test_tiles_make_up_the_picture(scene: str, method: str, asked: dict, precise_renderer) -> None:
    tiles = Region.of(SIZE, None).tiles(16)
    assert len(tiles) == 6 and sum(w * h for w, h in (t.size for t in tiles)) == 37 * 29
    with rt.Tracer(scene, method) as tracer:
        whole = np.asarray(tracer.render(size=SIZE, **asked))
        drawn = np.zeros_like(whole)
        for tile in tiles:
            x, y, width, height = tile.box
            part = np.asarray(tracer.render(size=SIZE, region=tile.box, **asked))
            assert part.shape == (height, width, 3)
            drawn[y:y + height, x:x + width] = part
        assert (drawn == whole).all()
        assert (np.asarray(tracer.render(size=SIZE, **asked)) == whole).all()
    assert whole.std() > 5


def test_a_region_may_need_fewer_waves_than_the_picture(monkeypatch, precise_renderer) -> None:
    """A region equals its part of the picture even if the numbers of waves differ.

    A wave is a set of paths that are traced at once. Here the region traces all of its samples in
    one wave, and the whole picture needs one wave per sample.
    """
    monkeypatch.setattr("gpgpu_rt.render.path.WAVE", 2048)
    with rt.Tracer("cornell-light", "bvh-packet") as tracer:
        whole = np.asarray(tracer.render(size=SIZE, integrator="path", samples=6))
        part = np.asarray(tracer.render(size=SIZE, integrator="path", samples=6,
                                        region=(8, 4, 16, 16)))
    assert (part == whole[4:20, 8:24]).all() and part.std() > 5


@pytest.mark.parametrize("region", [(-1, 0, 2, 2), (0, 0, 0, 2), (36, 0, 2, 2), (0, 28, 1, 2),
                                    (0, 0, 4), "here"])
def test_invalid_regions_are_refused(region: object) -> None:
    """Regions that are empty, malformed or not inside the picture are refused."""
    with rt.Tracer("cornell") as tracer, pytest.raises(rt.OptionError, match="region"):
        tracer.render(size=SIZE, region=region)


def test_the_rasteriser_draws_whole_pictures() -> None:
    """Rasterised first hits are refused for a region, and rasterised bounds are allowed."""
    with rt.Tracer("cornell", rasterised_bounds=8) as tracer:
        with pytest.raises(rt.OptionError, match="traced"):
            tracer.render(size=SIZE, region=(0, 0, 8, 8), first_hits="rasterised")
        part = np.asarray(tracer.render(size=SIZE, region=(8, 8, 16, 8)))
        assert (part == np.asarray(tracer.render(size=SIZE))[8:16, 8:24]).all()
