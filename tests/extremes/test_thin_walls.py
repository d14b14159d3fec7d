"""The table of docs/extremes.md on long thin triangles: hits that the watertight test loses.

The table states a known fault. When the fault is mended, this test and the table change.
"""
from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

import gpgpu_rt as rt

PAGE = Path(rt.__file__).parents[1] / "docs" / "extremes.md"
ROWS = re.findall(r"\| (\d+) \| (\d+) \| (\d+) \| ([\d.]+) \|", PAGE.read_text(encoding="utf-8"))
RAYS = 4000


def rays_inside(height: int, sections: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns rays in random directions that start 1e-4 to 0.1 inside the wall of a cylinder of
    radius 1, (RAYS, 3) float32 each."""
    rng = np.random.default_rng(3)
    angle, distance = rng.uniform(0, 2 * np.pi, RAYS), 10.0 ** rng.uniform(-4, -1, RAYS)
    radius = np.cos(np.pi / sections) - distance
    along = rng.uniform(-0.49 * height, 0.49 * height, RAYS)
    origins = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), along])
    return origins.astype(np.float32), rng.normal(size=(RAYS, 3)).astype(np.float32)


def test_the_page_has_the_table() -> None:
    assert len(ROWS) == 4


@pytest.mark.parametrize("height, sections, lost, error", ROWS)
def test_long_triangles_beside_the_origin(exact_renderer, height: str, sections: str, lost: str,
                                          error: str) -> None:
    mesh = trimesh.creation.cylinder(radius=1, height=int(height), sections=int(sections))
    origins, directions = rays_inside(int(height), int(sections))
    truth = rt.reference.trace(mesh, origins, directions)
    assert truth.hit.all()
    with rt.Tracer(mesh, "brute-force") as tracer:
        hits = tracer.trace(origins, directions)
    found = hits.hit & (hits.triangle == truth.triangle)
    errors = np.abs(hits.t - truth.t)[found] * np.linalg.norm(directions, axis=1)[found]
    assert (~hits.hit).sum() == int(lost)
    assert f"{errors.max():.2g}" == error
    with rt.Tracer(mesh, "brute-force", intersection="plucker") as tracer:
        hits = tracer.trace(origins, directions)
    assert hits.hit.all() and (np.abs(hits.t - truth.t) * np.linalg.norm(directions, axis=1)
                               ).max() < 1e-5
