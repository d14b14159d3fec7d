"""Each family of rays in the conformance suite finds faults. A test puts a fault into the
project's programs. Then some rays of the family must get wrong answers."""
from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import mirror
import pytest

import gpgpu_rt as rt
from gpgpu_rt.conform.answers import EngineAnswers
from gpgpu_rt.conform.case import FAMILIES
from gpgpu_rt.conform.suite import RAYS, Known
from gpgpu_rt.gl import shader

TRIANGLE, WATERTIGHT = "core/triangle.glsl", "core/watertight.glsl"
SLACK, KD = "core/slack.glsl", "methods/kdtree/kd_common.glsl"
AHEAD = "bool ahead = t >= ray.t_min;"
INSIDE = "bool inside = none_below_zero(w) || none_above_zero(w);"
NEARER = "(t < hit.t || (t == hit.t && index < hit.triangle))"

# Fault -> method, options, and (file, right text, faulty text) of each change.
FAULTS: dict[str, tuple[str, dict, list[tuple[str, str, str]]]] = {
    "strict comparison": ("brute-force", {}, [
        (WATERTIGHT, INSIDE, "bool inside = all_above_zero(w) || all_below_zero(w);")]),
    "unpadded slab": ("bvh-threaded", {}, [
        (SLACK, "BOX_SLACK = 64.0", "BOX_SLACK = 0.0"),
        (SLACK, "SPACING = 2.0", "SPACING = 0.0")]),
    "chopped interval": ("kd-restart", {}, [
        (KD, "takes_far || t_split >= state.t_max", "true")]),
    "strict interval": ("kd-restart", {"interval": "strict"}, []),
    "reciprocal of zero": ("kd-restart", {}, [
        ("core/ray.glsl", "vec3(not_zero(d.x), not_zero(d.y), not_zero(d.z))", "d")]),
    "absolute epsilon": ("brute-force", {}, [(WATERTIGHT, "abs(det) >= LEAST_NORMAL",
                                              "abs(det) > 1e-8")]),
    "NaN passes": ("brute-force", {}, [
        (WATERTIGHT, " && abs(det) >= LEAST_NORMAL", ""),
        (WATERTIGHT, "return t > nearest ? (t < furthest ? t : furthest) : nearest;", "return t;"),
        (TRIANGLE, AHEAD, "bool ahead = !(t < ray.t_min);"),
        (TRIANGLE, NEARER, "!(t >= hit.t)")]),
    "t from depths": ("brute-force", {}, [
        (WATERTIGHT,
         "float t = plane_distance(ray, normal, apex.x ? v0 : apex.y ? v1 : v2, depths);",
         "float t = dot(w, depths) * inv_det;")]),
    "t_min ignored": ("brute-force", {}, [(TRIANGLE, AHEAD, "bool ahead = t >= 0.0;")]),
    "first hit wins": ("brute-force", {}, [(TRIANGLE, NEARER, "hit.t == ray.t_max")]),
    "far sentinel": ("brute-force", {}, [(TRIANGLE, AHEAD,
                                          "bool ahead = t >= ray.t_min && t < 1e4;")]),
    "back faces culled": ("brute-force", {}, [
        (WATERTIGHT, INSIDE, "bool inside = none_below_zero(w);")]),
    "not watertight": ("brute-force", {"intersection": "moller-trumbore"}, []),
}
# Contraction fuses a product and a sum into one operation with a single rounding. The tests'
# renderers do not contract, so tests/mirror.py imitates contraction.
CONTRACTION = "contraction"

# Fault -> the families that must find the fault.
FOUND = {
    "strict comparison": (
        "cell-corners", "sphere-vertices", "sphere-edges", "embree-vertices", "embree-edges",
        "box-vertices", "box-edges", "box-fine", "square-32", "moved-1e0", "moved-1e2",
        "moved-1e4", "moved-1e5", "moved-1e6", "signed-zeros", "slab-planes", "flat-box",
        "denormals"),
    "unpadded slab": ("sphere-vertices", "embree-vertices", "box-vertices", "box-edges",
                      "box-fine", "square-32"),
    "chopped interval": ("in-planes", "spanning", "diagonals", "box-corners", "long-way",
                         "sphere-random", "near-planes", "lengths", "coplanar"),
    "strict interval": ("in-planes", "outside", "from-afar", "grazing", "segments"),
    "reciprocal of zero": ("moved-1e5",),
    "absolute epsilon": ("scaled-2^-20", "stadium"),
    "NaN passes": ("flat-floor", "flat-soup", "flat-tilted", "slab-planes"),
    "t from depths": ("thin-walls",),
    "t_min ignored": ("intervals", "empty-intervals", "flat-soup"),
    "first hit wins": ("one-centroid", "outside", "spanning"),
    "far sentinel": ("scaled-2^20", "long-way"),
    "back faces culled": ("one-triangle", "coincident", "degenerate"),
    "not watertight": ("sphere-edges", "slivers", "moved-1e4"),
    CONTRACTION: ("sphere-edges", "moved-1e2"),
}


@pytest.fixture
def faulty(request: pytest.FixtureRequest, tmp_path: Path,
           monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Makes tracers use a copy of glsl/ with the fault that the test asks for."""
    changes = FAULTS[request.param][2]
    if changes:
        shutil.copytree(shader.ROOT, tmp_path / "glsl")
        for name, right, wrong in changes:
            text = (tmp_path / "glsl" / name).read_text()
            assert text.count(right) == 1, f"{name} changed: {right!r}"
            (tmp_path / "glsl" / name).write_text(text.replace(right, wrong))
        monkeypatch.setattr(shader, "ROOT", tmp_path / "glsl")
    yield


def wrong_rays(known: Known, method: str, options: dict) -> int:
    case = known.case
    with rt.Tracer(case.scene, method, **{**case.options.get(method, {}), **options}) as tracer:
        hits = tracer.trace(*case.rays)
    return int(known.judge(EngineAnswers(hits.triangle, hits.t), slice(None)).wrong.sum())


def test_every_family_finds_a_fault() -> None:
    assert {name for names in FOUND.values() for name in names} == set(FAMILIES)


@pytest.mark.parametrize("faulty, fault", [(fault, fault) for fault in FAULTS],
                         indirect=["faulty"], ids=[fault.replace(" ", "-") for fault in FAULTS])
def test_families_find_the_fault(precise_renderer, faulty, fault: str) -> None:
    method, options, _ = FAULTS[fault]
    missed = [name for name in FOUND[fault]
              if not wrong_rays(Known.of(name, RAYS), method, options)]
    assert not missed


@pytest.mark.parametrize("name", FOUND[CONTRACTION])
def test_families_find_contraction(name: str) -> None:
    """With contraction, about one ray of 150 passes between two triangles. So this test uses more
    rays than the quick suite."""
    known = Known.of(name, 1200)
    case, found = known.case, []
    for contract in (False, True):
        hits = mirror.trace(case.triangles, case.origins, case.directions, contract=contract)
        answers = EngineAnswers(hits.triangle, hits.t)
        found.append(int(known.judge(answers, slice(None)).wrong.sum()))
    assert found[0] == 0 and found[1] > 0, found
