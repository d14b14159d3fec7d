"""No method returns a wrong hit in the four scenes of Foley and Sugerman 2005. A hit is wrong if
its error exceeds the bound that is derived for its ray."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import FOLEY, RAY_SETS, part_of, real_scene

import gpgpu_rt as rt
from gpgpu_rt.accuracy.judge import judge

KINDS = ("eye", "random", "vertices", "edges")
ANSWER = ("t", "u", "v", "triangle", "status")
SIDE = 500  # 10^6 rays per scene: 250,000 of each kind
# Slow methods trace fewer rays: the square of the number in SIDES. Brute force tests every
# triangle for each ray, and a texture stack needs passes for each level. `ray-classification` and
# `visibility-field` build lists that few rays share. `ray-tiles` tests all triangles against all
# tiles. `ray-hierarchy` tests all triangles against cones, and incoherent rays have wide cones.
# tests/methods/ray_tiles traces a million incoherent rays with `ray-tiles`.
SIDES = {"brute-force": 160, "kd-texture-stack": 160, "ray-classification": 40,
         "visibility-field": 160, "ray-tiles": 160, "ray-hierarchy": 32}
COHERENT = ("ray-tiles",)  # these methods trace the eye rays of the whole image


def check(name: str, kind: str, side: int, sides: dict[str, int], seed: int) -> None:
    scene = real_scene(name)
    origins, directions = RAY_SETS[kind](scene, side * side, seed)
    reference = rt.reference.trace(scene, origins, directions, accelerated=True)
    wrong, verdicts = {}, {}  # most methods agree, so judge each distinct answer once
    for row in rt.methods():
        whole = kind == "eye" and row.name in COHERENT
        n = (side if whole else sides.get(row.name, side)) ** 2
        if not n:
            continue
        some = slice(0, len(origins), max(1, len(origins) // n))
        shape = (side, side, 3) if whole else (-1, 3)
        with rt.Tracer(scene, row.name) as tracer:
            hits = tracer.trace(origins[some].reshape(shape), directions[some].reshape(shape))
        answer = some.step, *(getattr(hits, field).tobytes() for field in ANSWER)
        if answer not in verdicts:
            verdicts[answer] = judge(scene, origins[some], directions[some], hits,
                                     reference=part_of(reference, some))
        verdict = verdicts[answer]
        if verdict.wrong_share:
            wrong[row.name] = verdict.counts
    assert not wrong


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", [41], ids="seed{}".format)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FOLEY)
def test_no_ray_of_a_million_is_wrong(name: str, kind: str, seed: int) -> None:
    check(name, kind, SIDE, SIDES, seed)


@pytest.mark.parametrize("name, kind", [("bunny", "edges"), ("kitchen", "vertices")])
def test_few_rays_find_no_fault(name: str, kind: str) -> None:
    check(name, kind, 64, dict.fromkeys(SIDES, 0), 42)


def test_the_judge_counts_wrong_t() -> None:
    """The test makes the t of seven hits wrong. The judge counts exactly these seven hits."""
    scene = real_scene("cornell")
    origins, directions = RAY_SETS["random"](scene, 400, 1)
    with rt.Tracer(scene) as tracer:
        hits = tracer.trace(origins, directions)
    hits.t[np.flatnonzero(hits.hit)[:7]] *= 1.01
    assert judge(scene, origins, directions, hits).wrong_share == pytest.approx(7 / 400)
