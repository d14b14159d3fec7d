"""Exposure and tone map: light of known strength gets the grey level of the tone map's formula."""
from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.render import path as path_tracing
from gpgpu_rt.render.tone_map import TONE_MAPS, shown

INTEGRATORS = ["direct", "whitted", "path"]


def lamp(*radiance: float) -> rt.Scene:
    """Returns a lamp that fills the picture and is the only light."""
    corners = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
    return rt.Scene.from_arrays(corners, [[0, 1, 2], [0, 2, 3]], lights=(), environment=None,
                                colours=(0, 0, 0), materials=(rt.Material(emission=radiance),),
                                camera=rt.Camera((0, 0, 1), (0, 0, 0), fov=60))


def grey(linear: float) -> int:
    """Returns the grey level of linear light, by the definition of sRGB."""
    srgb = 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055
    return int(255 * min(srgb, 1.0) + 0.5)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("options, wanted", [
    ({}, [255, grey(0.5), grey(0.25)]),
    ({"exposure": 1.0}, [255, 255, grey(0.5)]),
    ({"exposure": -3}, [grey(0.25), grey(0.0625), grey(0.03125)]),
    # The luminance is 0.2126 * 2 + 0.7152 * 0.5 + 0.0722 * 0.25 = 0.80085.
    ({"tone_map": "reinhard"}, [255, grey(0.5 / 1.80085), grey(0.25 / 1.80085)]),
    # The curve at 1 is 2.54 / 3.16, and at 0.5 it is 0.5 * 1.285 / (0.5 * 1.805 + 0.14).
    ({"tone_map": "aces", "exposure": 1}, [grey(4 * 10.07 / (4 * 10.31 + 0.14)), grey(2.54 / 3.16),
                                           grey(0.6425 / 1.0425)])])
def test_light_of_known_strength(integrator: str, options: dict, wanted: list[int]) -> None:
    """Exposure and tone map give the grey levels that follow from their formulas."""
    with rt.Tracer(lamp(2.0, 0.5, 0.25)) as tracer:
        more = {"samples": 2} if integrator == "path" else {}
        found = np.asarray(tracer.render(size=(4, 4), integrator=integrator, **more, **options))
    assert np.abs(found.astype(int) - wanted).max() <= 1
    assert len(np.unique(found.reshape(-1, 3), axis=0)) == 1


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_an_exposure_changes_only_its_own_picture(precise_renderer, integrator: str) -> None:
    """A picture without options is the same before and after a picture with an exposure. With an
    exposure, a region equals the same part of the whole picture."""
    drawing = {"size": (24, 16), "integrator": integrator,
               **({"samples": 4} if integrator == "path" else {})}
    with rt.Tracer("cornell-light") as tracer:
        plain = np.asarray(tracer.render(**drawing))
        bright = np.asarray(tracer.render(**drawing, exposure=1.5, tone_map="aces"))
        part = tracer.render(**drawing, exposure=1.5, tone_map="aces", region=(5, 3, 9, 8))
        assert (np.asarray(part) == bright[3:11, 5:14]).all()
        assert (np.asarray(tracer.render(**drawing)) == plain).all()
        named = tracer.render(**drawing, exposure=0.0, tone_map="linear")
        assert (np.asarray(named) == plain).all()
        assert bright.mean() > plain.mean() + 10
        if integrator == "path":
            assert (shown(tracer.radiance.astype(float)) == plain).all()


@pytest.mark.parametrize("tone_map", TONE_MAPS)
def test_curves_rise_from_black_to_white(tone_map: str) -> None:
    light = np.repeat(np.r_[0, np.geomspace(1e-4, 1e38, 400)][:, None], 3, 1)
    found = shown(light, 0.0, tone_map).astype(int)
    assert found[0].max() == 0 and found[-1].min() >= 254 and (np.diff(found, axis=0) >= 0).all()
    assert (shown(np.full((1, 3), np.inf), 3.0, tone_map) >= 254).all()


def test_an_interrupted_picture_has_the_exposure(monkeypatch) -> None:
    """The unfinished picture after an interrupt has the requested exposure."""
    monkeypatch.setattr(path_tracing, "WAVE", 4 * 16 * 16)

    def interrupt(done: int, samples: int, noise: float) -> None:
        raise KeyboardInterrupt
    with rt.Tracer(lamp(4.0, 4.0, 4.0)) as tracer:
        with pytest.raises(KeyboardInterrupt):
            tracer.render(size=(16, 16), integrator="path", samples=64, exposure=-4,
                          progress=interrupt)
        assert abs(int(np.asarray(tracer.unfinished()).max()) - grey(0.25)) <= 1


def test_on_the_command_line(precise_renderer, tmp_path) -> None:
    """`gpgpu-rt render` draws the same picture as `Tracer.render` with the same options."""
    target = tmp_path / "a.png"
    words = ["render", "cornell-light", "--size", "16x12", "-o", str(target)]
    assert cli.main([*words, "--exposure=-1", "--tone-map", "reinhard"]) == 0
    with rt.Tracer("cornell-light") as tracer, Image.open(target) as image:
        same = tracer.render(size=(16, 12), exposure=-1, tone_map="reinhard")
        assert (np.asarray(image) == np.asarray(same)).all()


@pytest.mark.parametrize("words, message", [
    (["--exposure", "nan"], "exposure=nan must be at least -32"),
    (["--exposure", "99"], "at most 32"),
    (["--exposure", "much"], "must be float"),
    (["--tone-map", "acse"], "did you mean aces")])
def test_bad_values_are_one_line(tmp_path, capsys, words: list[str], message: str) -> None:
    target = tmp_path / "a.png"
    assert cli.main(["render", "cornell", "--size", "8", "-o", str(target), *words]) == 1
    err = capsys.readouterr().err
    assert message in err and err.count("\n") == 1 and not target.exists()
