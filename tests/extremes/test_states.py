"""After every pass, the state textures contain no NaN. An infinity always means "no end".

Row 23 of the catalogue of extreme cases (docs/extremes.md): the state of a finished ray never
changes.
"""
from __future__ import annotations

import numpy as np
import pytest
from watching import Fields, watching

import gpgpu_rt as rt
from gpgpu_rt.conform.families import make_case
from gpgpu_rt.gl.textures import read_texture
from gpgpu_rt.rays.records import NO_TRIANGLE

METHODS = {row.name: row for row in rt.methods()}
SCHEDULED = [(name, schedule) for name, row in METHODS.items() for schedule in row.schedules]
SMALL = {"brute-force": 40}  # number of triangles; each triangle needs a pass
NO_END = {"t_max", "t_exit"}  # fields that may hold infinity for "no end"


def scan(state: Fields, hit: Fields) -> None:
    """Fails if the states or hits of a pass contain a NaN, or an infinity without a meaning."""
    for name, values in state.items():
        assert not np.isnan(values).any(), f"NaN in {name}"
        assert name in NO_END or np.isfinite(values).all(), f"infinity in {name}"
    if not hit:  # a pass over packets has no hits
        return
    nothing = hit["triangle"] == NO_TRIANGLE
    if "t" not in hit:  # an any-hit pass of packets stores only the triangle
        return
    for name in ("t", "u", "v"):
        assert not np.isnan(hit[name]).any(), f"NaN in hit.{name}"
    assert np.isfinite(hit["t"][~nothing]).all(), "a hit at infinity"
    assert np.isfinite(hit["u"]).all() and np.isfinite(hit["v"]).all()


def few(name: str, method: str, rays: int, seed: int) -> tuple[rt.Scene, np.ndarray, np.ndarray]:
    """Returns the scene of a case, reduced to its last triangles, and the case's rays."""
    case = make_case(name, rays, seed)
    case.triangles = case.triangles[-SMALL.get(method, 300):]
    return case.scene, case.origins.copy(), case.directions.copy()


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("name, method, schedule", [
    pytest.param(name, method, schedule, id=f"{name}-{method}-{schedule}",
                 marks=pytest.mark.small if name == "near-planes" else
                 () if name == "degenerate" and schedule != "kernels" else pytest.mark.full)
    for name in ("near-planes", "degenerate", "denormals", "signed-zeros", "embree-vertices",
                 "from-afar") for method, schedule in SCHEDULED])
def test_no_nan_in_any_state(name: str, method: str, schedule: str, seed: int) -> None:
    scene, origins, directions = few(name, method, 150, seed)
    origins[3], directions[5], directions[7] = np.nan, np.inf, 0
    passes = []

    def look(state: Fields, hit: Fields) -> None:
        passes.append(0)
        scan(state, hit)
    with rt.Tracer(scene, method, schedule=schedule) as tracer, watching(tracer, look):
        hits = tracer.trace(origins, directions, invalid="miss")
        tracer.occluded(origins, directions, 2.0, invalid="miss")
    assert hits.status.tolist().count(1) == 3 and len(passes) >= 2
    # A method with its own driver may need only two to four passes over states.
    assert len(passes) > 4 or schedule == "loop" or schedule in METHODS[method].drivers


@pytest.mark.parametrize("scale", [2.0**-20, 1.0, 2.0**20])
@pytest.mark.parametrize("method", METHODS)
def test_no_nan_in_a_picture(method: str, scale: float) -> None:
    """The ray, shading and colour textures of a picture are finite, except that t_max may be
    infinite. The scene has triangles without area, and the eye is inside the scene."""
    case = make_case("degenerate", 1, 2)
    case.triangles *= np.float32(scale)
    scene = case.scene
    with rt.Tracer(scene, method) as tracer, watching(tracer, scan):
        tracer.render(size=(16, 16))
        room = tracer.sessions.pictures.integrator.room
        shadow, eye = room.textures("shadow rays"), tracer.session.buffers.rays.textures
        starts, ends = zip(shadow, eye)
        colours = [*room.textures("lit"), *room.textures("direct"), *room.textures("screen")]
        with tracer.gpu:
            starts, ends, colours = (list(map(read_texture, t)) for t in (starts, ends, colours))
    for values in starts + colours:
        assert np.isfinite(values).all()
    for values in ends:  # t_max is the last channel
        assert np.isfinite(values[..., :3]).all() and not np.isnan(values).any()
    # A target has undefined content before its first draw. Unit directions show that a pass drew
    # this target.
    assert np.abs(np.linalg.norm(ends[1][..., :3], axis=2) - 1).max() < 1e-6


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("method", [name for name, row in METHODS.items()
                                    if "step" in row.schedules])
def test_row_23_the_state_of_a_finished_ray_stays_the_same(method: str, seed: int) -> None:
    """Some rays have empty intervals, and some texels lie past the last ray."""
    scene, origins, directions = few("signed-zeros", method, 150, seed)
    t_max = np.full(150, np.inf, np.float32)
    t_max[::5] = -1
    first, last = {}, {}

    def look(state: Fields, hit: Fields) -> None:
        if not hit:  # a pass over packets has no hits
            return
        words = np.column_stack([np.float32(v).reshape(len(v), -1).view(np.uint32)
                                 for v in (*state.values(), *hit.values())])
        for ray in np.flatnonzero(state["phase"] <= 0):
            first.setdefault(ray, words[ray])
            last[ray] = words[ray]
    # A mask interval longer than the longest walk masks no ray, so every pass writes every ray.
    with rt.Tracer(scene, method, schedule="step", mask_interval=60) as tracer:
        with watching(tracer, look):
            hits = tracer.trace(origins, directions, t_max=t_max)
    assert len(first) >= 150 and not hits.hit[::5].any() and hits.hit.any()
    assert all((first[ray] == last[ray]).all() for ray in first)
