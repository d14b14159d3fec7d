"""The suite's cases are the same on every machine, and their answers are exact."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from exhaustive import nearest

from gpgpu_rt import reference
from gpgpu_rt.conform.case import FAMILIES
from gpgpu_rt.conform.export import digest
from gpgpu_rt.conform.families import make_case

DIGESTS = json.loads((Path(__file__).parent / "digests.json").read_text())
SEEDS = (1, 2)
FULL_RAYS = 10**7       # approximate number of rays in the full test, for all families together


def digests() -> dict[str, list[str]]:
    """Returns the content of digests.json. After a change of a family, write this
    content to the file as JSON."""
    return {name: [digest(make_case(name, 50, seed)) for seed in SEEDS] for name in FAMILIES}


@pytest.mark.parametrize("name", FAMILIES)
def test_cases_have_the_known_bits(name: str) -> None:
    assert [digest(make_case(name, 50, seed)) for seed in SEEDS] == DIGESTS[name]


@pytest.mark.parametrize("name", FAMILIES)
def test_the_scene_does_not_depend_on_the_number_of_rays(name: str) -> None:
    few, many = (make_case(name, rays, 3).triangles for rays in (2, 70))
    assert few.tobytes() == many.tobytes()


def check_exact(name: str, rays: int, seed: int, tree: bool = False) -> None:
    """Compare the answers of two computations, which share no code but numpy if ``tree`` is False.
    With ``tree``, both computations find candidates in the reference's tree of boxes.

    The first computation, the reference, uses float64 with error bounds, and integers where the
    bounds do not decide. The second is `nearest`. If the ray's line meets a triangle's box,
    `nearest` tests the triangle in integers, unless float64 already proves a miss.
    """
    case = make_case(name, rays, seed)
    rays = reference.as_rays(*case.rays, "raise")[:4]
    found = reference.exact_hits(reference.as_triangles(case.triangles), *rays)
    triangle, t = nearest(case.triangles, *case.rays, tree=tree)
    differing = np.flatnonzero(found.triangle != triangle)
    assert not len(differing), (len(differing), differing[:5])
    assert found.t.tobytes() == t.tobytes()


@pytest.mark.parametrize("seed", [5], ids="seed{}".format)
@pytest.mark.parametrize("name", FAMILIES)
def test_two_paths_agree(name: str, seed: int) -> None:
    check_exact(name, min(FAMILIES[name].most, 100), seed)


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", [6], ids="seed{}".format)
@pytest.mark.parametrize("name", FAMILIES)
def test_two_paths_agree_in_full(name: str, seed: int) -> None:
    slow = FAMILIES[name].most < 1000
    rays = 10 * FAMILIES[name].most if slow else FULL_RAYS // 40
    # Check slow families in small parts: 1,000 rays of "coincident" need 20 GB.
    at_once = FAMILIES[name].most if slow else 50_000
    for part in range(0, rays, at_once):
        check_exact(name, min(at_once, rays - part), seed + part, tree=True)
