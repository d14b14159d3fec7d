"""Checks a table of docs/extremes.md, which counts the hits that `bvh-threaded` loses. The t of a
lost hit lies outside the interval in which the ray crosses the box of the hit triangle."""
from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.draws import bell, between, cross, directions, unit
from gpgpu_rt.conform.shapes import aims_at

PAGE = Path(rt.__file__).parents[1] / "docs" / "extremes.md"
ROWS = [(kind, int(power), int(lost)) for kind, power, lost in re.findall(
    r"^\| (triangles|a plane) .*?10\^-?(\d+).*\| (\d+) of 100,000 \|$", PAGE.read_text("utf-8"),
    re.M)]
RAYS = 100_000


def needles(power: int, rng: np.random.Generator) -> Case:
    """Returns rays that aim at oblique triangles. Each triangle is 10^power times as long as
    wide."""
    base, along = between(rng, -1, 1, (300, 1, 3)), directions(rng, 300)
    across = unit(cross(along, directions(rng, 300))) / 10 ** power
    triangles = np.float32(base + np.stack([0 * along, along, 0.3 * along + across], axis=1))
    origins = np.float32(3 * directions(rng, RAYS))
    return Case(triangles, origins, aims_at(triangles, RAYS, rng, "insides") - origins)


def planes(power: int, rng: np.random.Generator) -> Case:
    """Returns rays that meet an oblique square at an angle of 10^-power radians."""
    first = directions(rng, 1)
    normal = unit(cross(first, directions(rng, 1)))
    second = cross(normal, first)
    square = np.stack([-first - second, first - second, first + second, second - first], 1)
    triangles = np.float32(square[:, [[0, 1, 2], [0, 2, 3]]])[0]
    aims = between(rng, -0.9, 0.9, (RAYS, 1)) * first + between(rng, -0.9, 0.9, (RAYS, 1)) * second
    towards = unit(bell(rng, (RAYS, 1)) * first + bell(rng, (RAYS, 1)) * second)
    origins = np.float32(aims - 2 * towards + 2 * normal / 10 ** power)
    return Case(triangles, origins, aims - origins)


def test_the_page_has_the_table() -> None:
    assert [row[:2] for row in ROWS] == [("triangles", 4), ("triangles", 5), ("triangles", 6),
                                         ("a plane", 5), ("a plane", 6)]


@pytest.mark.parametrize("kind, power, lost", ROWS)
def test_rays_that_begin_and_end_at_their_hit(exact_renderer, kind: str, power: int, lost: int
                                              ) -> None:
    """The page says how many of 100,000 hits are lost if t_min and t_max equal the hit's t."""
    case = {"triangles": needles, "a plane": planes}[kind](power, np.random.default_rng(1))
    with rt.Tracer(case.scene, "brute-force") as brute, rt.Tracer(
            case.scene, "bvh-threaded") as tracer:
        hits = brute.trace(*case.rays)
        found = case.part(hits.hit)
        found.t_min = found.t_max = hits.t[hits.hit]
        expected, got = brute.trace(*found.rays), tracer.trace(*found.rays)
    assert expected.hit.all()
    assert round((~got.hit).mean() * RAYS) == lost
