"""A ray batch has the same texels whether its rays are written in blocks or all at once."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.rays import batch as ray_batch
from gpgpu_rt.rays.batch import RayBatch
from gpgpu_rt.rays.records import NO_RAY

BOUNDS = np.float32([-1, -1, -1]), np.float32([1, 1, 1])
BLOCK = 256


def _rays(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return origins in the box, directions whose largest component has a size in [0.5, 1), and
    t_max in [0, 1)."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions *= rng.uniform(0.5, 0.999, (count, 1)) / np.abs(directions).max(1, keepdims=True)
    return (rng.uniform(-1, 1, (count, 3)).astype(np.float32), directions.astype(np.float32),
            rng.random(count).astype(np.float32))


@pytest.fixture(params=[1, 10 ** 9], ids=["threads", "alone"])
def blocks(request, monkeypatch) -> None:
    """Make blocks small, and lay them out in several threads or in one thread."""
    monkeypatch.setattr(ray_batch, "AT_ONCE", BLOCK)
    monkeypatch.setattr("gpgpu_rt.threads.WORTH", request.param)


def _all_at_once(monkeypatch, *rays: np.ndarray, **more: object) -> RayBatch:
    with monkeypatch.context() as patch:
        patch.setattr(ray_batch, "AT_ONCE", 10 ** 9)
        return RayBatch(*rays, bounds=BOUNDS, **more)


def _texels(batch: RayBatch) -> np.ndarray:
    """Return the two texels of each ray and of the padding after the last ray, (n, 2, 4)."""
    return np.stack([batch.texels(k).reshape(-1, 4) for k in range(2)], 1)


@pytest.mark.parametrize("ends", [False, True], ids=["open", "ends"])
@pytest.mark.parametrize("count", [0, 1, 127, 255, 256, 257, 1000])
def test_blocks_have_the_texels_of_a_whole(blocks, monkeypatch, count: int, ends: bool) -> None:
    origins, directions, t_max = _rays(count, seed=3)
    more = {"t_min": t_max / 2, "t_max": t_max} if ends else {}
    whole = _all_at_once(monkeypatch, origins, directions, **more)
    found = RayBatch(origins, directions, bounds=BOUNDS, **more)
    assert np.array_equal(_texels(found), _texels(whole)) and found.size == whole.size
    assert not len(found.invalid) and (found.start is None) == (count != 1)


@pytest.mark.parametrize("at", [5, 255, 256, 700, 999])
@pytest.mark.parametrize("what", [
    "origin NaN", "origin inf", "origin far", "direction 0", "direction NaN", "direction inf",
    "direction long", "direction short", "t_min NaN", "t_max NaN"])
def test_an_unusual_ray_is_found_in_any_block(blocks, monkeypatch, what: str,
                                              at: int) -> None:
    """A ray that is invalid, or starts far away, or has a direction of unusual length, gets the
    right texels in any block."""
    name, fault = what.split()
    origins, directions, t_max = _rays(1000, seed=4)
    given = {"origin": origins, "direction": directions, "t_min": np.zeros(1000, np.float32),
             "t_max": t_max}
    given[name][at] = {"far": 100, "long": 2, "short": 0.25, "0": 0, "NaN": np.nan,
                       "inf": np.inf}[fault]
    if fault == "far":
        directions[at] = -0.75      # towards the box
    rays = tuple(given.values())
    whole = _all_at_once(monkeypatch, *rays, invalid="miss")
    found = RayBatch(*rays, bounds=BOUNDS, invalid="miss")
    assert _texels(found).tobytes() == _texels(whole).tobytes()
    assert found.invalid.tolist() == whole.invalid.tolist() == (
        [] if fault in ("far", "long", "short") else [at])
    assert RayBatch(*rays, invalid="miss").invalid.tolist() == found.invalid.tolist()
    t = np.ones(1000, np.float32)
    mine, theirs = (batch.given_units(t, slice(None)) for batch in (found, whole))
    assert np.array_equal(mine, theirs, equal_nan=True)
    assert len(found.invalid) or mine[at] != 1


@pytest.mark.parametrize("count", [1, 128, 257, 1000])
@pytest.mark.parametrize("other", [None, 0, -1, 130])
def test_a_shared_start_needs_one_origin(blocks, count: int, other: int | None) -> None:
    """A batch has a shared start only if all of its rays have the same origin."""
    origins, directions, _ = _rays(count, seed=5)
    origins[:] = origins[0]
    if other is not None and -count <= other < count and count > 1:
        origins[other] += np.float32(0.125)
        assert RayBatch(origins, directions, bounds=BOUNDS).start is None
    else:
        start = RayBatch(origins, directions, 0.25, bounds=BOUNDS).start
        assert start.tolist() == [*origins[0].tolist(), 0.25]


@pytest.mark.parametrize("fault", [
    None, "another", "far", "far, as far on both sides", "NaN", "inf", "t_min", "exponent"])
def test_texels_do_not_depend_on_a_shared_start(blocks, fault: str | None) -> None:
    """The texels of a batch, and the fields that `sample` returns, are the same as if each ray had
    its own batch. This holds with and without a start that all rays share."""
    origins, directions, _ = _rays(1000, seed=8)
    origins[:] = origins[0]
    t_min = np.full(1000, 0.25, np.float32)
    origins[600] = {"another": 0.5, "NaN": np.nan, "inf": np.inf}.get(str(fault), origins[0])
    if str(fault).startswith("far"):
        origins[:] = (0, 0, 100) if "both" in str(fault) else 100
    if "both" in str(fault):    # the batch advances all origins by the same t, to two points
        directions[:] = [0.25, 0.125, -0.75]
        directions[::2, 0] *= -1
    t_min[600] = 0.5 if fault == "t_min" else 0.25
    directions[600] *= 4 if fault == "exponent" else 1
    rays = origins, directions, t_min
    found = RayBatch(*rays, bounds=BOUNDS, invalid="miss")
    assert (found.start is None) == (fault is not None)
    apart = [RayBatch(*(values[k:k + 1] for values in rays), bounds=BOUNDS, invalid="miss")
             for k in range(1000)]
    expected = np.concatenate([_texels(one) for one in apart])
    at = np.array([0, 0, 0]), np.array([1, 600, 999])
    sample = found.sample(*at)
    assert np.array_equal(_texels(found)[:1000], expected)
    assert np.array_equal(sample["origin"], expected[at[1], 0, :3])
    assert np.array_equal(sample["t_max"], expected[at[1], 1, 3])
    assert np.array_equal(found.given_fields()["origin"], expected[:, 0, :3])


@pytest.mark.parametrize("fault", [np.nan, np.inf])
@pytest.mark.parametrize("share", [0.01, 0.5, 1.0])
@pytest.mark.parametrize("seed", [6, 7], ids="seed{}".format)
def test_invalid_rays_do_not_change_valid_rays(blocks, seed: int, share: float, fault: float
                                               ) -> None:
    """Valid rays keep their texels if other rays are invalid. Some rays start far away, and some
    have directions of unusual lengths."""
    rng = np.random.default_rng(seed)
    origins, directions, t_max = _rays(1000, seed)
    origins[::7] *= 50
    directions[::3] *= rng.choice(np.float32([1e-20, 3, 1e20]), (334, 1))
    bad = rng.random(1000) < share
    names = rng.integers(3, size=1000)
    ill = origins.copy(), directions.copy(), t_max.copy()
    for kind, (array, value) in enumerate(zip(ill, (fault, fault, np.nan))):
        array[bad & (names == kind)] = value
    found = RayBatch(ill[0], ill[1], 0.0, ill[2], bounds=BOUNDS, invalid="miss")
    well = RayBatch(origins, directions, 0.0, t_max, bounds=BOUNDS)
    assert found.invalid.tolist() == np.flatnonzero(bad).tolist()
    texels, expected = (_texels(batch)[:1000] for batch in (found, well))
    assert (texels[bad] == NO_RAY[:2]).all()
    assert texels[~bad].tobytes() == expected[~bad].tobytes()
    t = rng.random(1000).astype(np.float32)
    rays = np.flatnonzero(~bad)
    assert (found.given_units(t[rays], rays) == well.given_units(t[rays], rays)).all()


def test_padding_is_never_live() -> None:
    """The texels after the last ray hold empty rays, whose t_max is -1. The interval of these rays
    is empty even if the t_min of all other rays is below -1."""
    count = ray_batch.ROW + 5
    batch = RayBatch(np.zeros((count, 3)), np.full((count, 3), 0.5), t_min=-2.0)
    width, height = batch.size
    sample = batch.sample(*np.divmod(np.arange(width * height), width))
    assert ((sample["t_min"] <= sample["t_max"]) == (np.arange(width * height) < count)).all()


@pytest.mark.parametrize("given, error", [
    ({"shape": (-2, -3)}, "shape is"), ({"shape": (2.0, 3.0)}, "shape is"),
    ({"shape": 6}, "shape is"), ({"shape": (6,)}, "shape is"), ({"shape": "23"}, "shape is"),
    ({"shape": (2, 4)}, "does not hold 6 rays"), ({"t_max": None}, "t_max must be numbers"),
    ({"t_min": [1, 2, "a", 3, 4, 5]}, "t_min must be numbers"),
    ({"t_min": [[1], [1, 2]]}, "t_min must be numbers"), ({"t_max": 1j}, "t_max must be numbers"),
    ({"t_max": [1, 2]}, "t_max has 2 values for 6 rays")], ids=str)
def test_wrong_arguments_are_refused(given: dict, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        RayBatch(np.zeros((6, 3)), np.ones((6, 3)), **given)


def test_numbers_past_float32_are_infinite(recwarn: pytest.WarningsRecorder) -> None:
    batch = RayBatch(np.zeros((6, 3)), np.ones((6, 3)), t_max=1e300)
    assert np.isinf(batch.given_fields()["t_max"]).all() and not len(recwarn)
