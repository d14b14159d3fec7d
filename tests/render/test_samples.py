"""With several samples per pixel, the brightness of a pixel in `whitted` and `direct` is the share
of the pixel's area that a bright object covers."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.render.tone_map import shown
from gpgpu_rt.render.whitted import places_in_pixel


def sheet(edge: float) -> rt.Scene:
    """Return a bright sheet that ends ``edge`` pixels from the left of a picture 8 pixels wide."""
    x = 2 * edge / 8 - 1
    corners = [(-9, -9, 0), (x, -9, 0), (x, 9, 0), (-9, 9, 0)]
    return rt.Scene.from_arrays(corners, [[0, 1, 2], [0, 2, 3]], lights=(), environment=None,
                                materials=(rt.Material(emission=(0.5, 0.5, 0.5)),),
                                camera=rt.Camera((0, 0, 1), (0, 0, 0), fov=90))


@pytest.mark.parametrize("integrator", ["direct", "whitted"])
@pytest.mark.parametrize("samples", [1, 4, 11, 64])
@pytest.mark.parametrize("edge", [3.3, 4.71])
def test_a_pixel_shows_how_much_of_it_is_covered(integrator: str, samples: int, edge: float
                                                 ) -> None:
    with rt.Tracer(sheet(edge)) as tracer:
        found = np.asarray(tracer.render(size=(8, 8), integrator=integrator, samples=samples))
    at = np.arange(8)[:, None] + 0.5 + np.array(list(places_in_pixel(samples)))[:, 0]
    covered = (at < edge).mean(axis=1)
    assert (np.abs(found.astype(int) - shown(0.5 * covered)[None, :, None]) <= 1).all()
    if samples == 64:
        assert np.abs(covered - np.clip(edge - np.arange(8), 0, 1)).max() <= 1 / 64


@pytest.mark.parametrize("samples", [2, 8, 32, 8192])
def test_places_are_a_net_around_the_middle(samples: int) -> None:
    """The 2^m samples of a pixel are a (0, m, 2)-net: each box that results from halving the pixel
    m times holds one sample. The mean of the samples is the pixel's middle."""
    places = np.array(list(places_in_pixel(samples)))
    assert np.abs(places).max() < 0.5 and np.abs(places.mean(axis=0)).max() < 1e-12
    for halved in range(samples.bit_length()):
        columns, rows = 1 << halved, samples >> halved
        cells = ((places + 0.5) * (columns, rows)).astype(int)
        assert len(np.unique(cells, axis=0)) == samples
    assert list(places_in_pixel(1)) == [(0.0, 0.0)]


def bits(method: str = "bvh-threaded", options: dict = {}, **asked: object) -> np.ndarray:
    with rt.Tracer("soft-shadows", method, **options) as tracer:
        return np.asarray(tracer.render(size=(24, 16), light_samples=2, bounces=2, samples=3,
                                        **asked))


def test_methods_bounds_and_features_do_not_change_the_picture(precise_renderer) -> None:
    """Another method, rasterised bounds and all features give the same picture."""
    expected = bits()
    assert (bits("kd-restart") == expected).all()
    assert (bits(options={"rasterised_bounds": 8}) == expected).all()
    assert (bits(all_features=True) == expected).all()
    with rt.Tracer("soft-shadows") as tracer:
        once = np.asarray(tracer.render(size=(24, 16), light_samples=2, bounces=2))
        assert tracer.statistics.samples == 0 and (once != expected).any()


def test_first_hits_beside_the_middle_are_not_rasterised() -> None:
    """With several samples per pixel, first hits cannot be rasterised. `render` reports its
    progress after each sample."""
    with rt.Tracer(sheet(3.3)) as tracer:
        with pytest.raises(rt.Error, match="first_hits=traced"):
            tracer.render(size=(8, 8), samples=2, first_hits="rasterised")
        told: list[int] = []
        tracer.render(size=(8, 8), samples=3, progress=lambda done, *rest: told.append(done))
        assert told == [1, 2, 3] and tracer.statistics.samples == 3
        with pytest.raises(rt.Error, match="samples"):
            tracer.render(size=(8, 8), samples=0)


@pytest.mark.parametrize("integrator, option, value, most", [
    ("direct", "samples", 10 ** 12, 2 ** 24), ("path", "samples", 10 ** 11, 2 ** 24),
    ("whitted", "light_samples", 10 ** 9, 2 ** 16), ("whitted", "bounces", 300, 64)])
def test_too_large_numbers_are_refused(integrator: str, option: str, value: int,
                                       most: int) -> None:
    with rt.Tracer(sheet(3.3)) as tracer:
        with pytest.raises(rt.OptionError, match=f"^option {option}={value} must be at most "
                                                 f"{most}$"):
            tracer.plan((8, 8), integrator, **{option: value})
