"""The watertight test equals its copy in numpy, tests/mirror.py, bit for bit. Contraction makes
the copy leak.

A compiler may turn a b - c d into a fused multiply-add, which rounds only one of the two products.
At an edge, the edge functions of the two triangles are then no longer exact negatives of each
other, so rays leak through the edge. The tests' renderers do not contract, so the copy shows the
effect.
"""
from __future__ import annotations

import re

import mirror
import pytest
from conftest import assert_same_bits

import gpgpu_rt as rt
from gpgpu_rt.conform.families import make_case
from gpgpu_rt.gl.shader import ROOT


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["sphere-edges", "embree-vertices", "outside", "signed-zeros",
                                  "grazing", "slivers"])
def test_mirror_gives_the_bits(exact_renderer, name: str, seed: int) -> None:
    case = make_case(name, 400, seed)
    with rt.Tracer(case.scene, "brute-force") as tracer:
        hits = tracer.trace(case.origins, case.directions)
    assert_same_bits(hits, mirror.trace(case.triangles, case.origins, case.directions))


@pytest.mark.parametrize("seed", [3])
def test_contraction_leaks(seed: int) -> None:
    case = make_case("sphere-edges", 1200, seed)
    rays = case.triangles, case.origins, case.directions
    assert mirror.trace(*rays).hit.all()
    assert not mirror.trace(*rays, contract=True).hit.all()


@pytest.mark.parametrize("seed", [4])
def test_row_6_double_hits(seed: int, record_property) -> None:
    """Each ray that aims at an edge of a closed mesh hits one or two triangles. The test records
    how many rays hit two."""
    case = make_case("sphere-edges", 1000, seed)
    count = mirror.hits_a_ray(case.triangles, case.origins, case.directions)
    record_property("rays that hit two triangles", int((count > 1).sum()))
    assert count.min() >= 1 and count.max() <= 2


def test_precise_stands_before_every_product_of_the_watertight_test() -> None:
    """Each variable that is computed from a product is declared `precise`, which forbids
    contraction."""
    body = (ROOT / "core/watertight.glsl").read_text()
    declared = re.findall(r"^\s*(PRECISE )?(?:float|vec[23]) (\w+) =(.*)$", body, re.M)
    products = {name: bool(precise) for precise, name, value in declared if " * " in value}
    assert {"xy", "area", "depths", "t"} <= set(products)
    assert all(products.values()), products
