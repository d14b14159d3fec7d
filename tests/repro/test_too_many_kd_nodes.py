"""In the past, the full figures failed for the scene Soda Hall. Its kd-tree has 24 million nodes,
but float32 is exact only for integers up to 2^24. The smallest subtrees of a large kd-tree now
become leaves, as in a BVH. The file tests/scene/test_large.py checks that the hits stay the
same."""
from __future__ import annotations

from conftest import random_soup

from gpgpu_rt.methods.kdtree import build
from gpgpu_rt.methods.kdtree.build import build_kdtree


def test_a_kd_tree_stays_within_what_floats_can_number(monkeypatch) -> None:
    triangles = random_soup(300, 4)
    assert len(build_kdtree(triangles).axis) > 2000
    monkeypatch.setattr(build, "EXACT_INTEGER", 2000)
    tree = build_kdtree(triangles)
    assert len(tree.axis) <= 2000 and len(tree.references) <= 2000
    assert len(set(tree.references.tolist())) == 300
