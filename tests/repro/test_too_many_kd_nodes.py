"""The full figures stopped at Soda Hall: its kd-tree has 24 million nodes, floats number 2^24. Its
smallest subtrees become leaves now, as a BVH's do (tests/scenes/test_large.py has the hits)."""
from __future__ import annotations

from conftest import random_soup

from gpgpu_rt import accel
from gpgpu_rt.accel import kdtree


def test_a_kd_tree_stays_within_what_floats_can_number(monkeypatch) -> None:
    triangles = random_soup(300, 4)
    assert len(accel.build_kdtree(triangles).axis) > 2000
    monkeypatch.setattr(kdtree, "EXACT_INTEGER", 2000)
    tree = accel.build_kdtree(triangles)
    assert len(tree.axis) <= 2000 and len(tree.references) <= 2000
    assert len(set(tree.references.tolist())) == 300
