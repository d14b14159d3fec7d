"""Checks docs/extremes.md: the errors of t for rays that start beside long thin triangles."""
from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

import gpgpu_rt as rt
from gpgpu_rt.trimesh_ray import RayMeshIntersector

PAGE = Path(rt.__file__).parents[1] / "docs" / "extremes.md"
ROWS = re.findall(r"\| (\d+) \| (\d+) \| ([\d.e-]+) \| ([\d.e-]+) \|",
                  PAGE.read_text(encoding="utf-8"))
RAYS = 4000


def rays_inside(height: int, sections: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns origins and random directions, (RAYS, 3) float32 each, of rays in a prism with
    ``sections`` sides and corners at radius 1. The origins lie in the largest cylinder that fits
    into the prism, 1e-4 to 0.1 from the cylinder's surface."""
    rng = np.random.default_rng(3)
    angle, distance = rng.uniform(0, 2 * np.pi, RAYS), 10.0 ** rng.uniform(-4, -1, RAYS)
    radius = np.cos(np.pi / sections) - distance
    along = rng.uniform(-0.49 * height, 0.49 * height, RAYS)
    origins = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), along])
    return origins.astype(np.float32), rng.normal(size=(RAYS, 3)).astype(np.float32)


def test_the_page_has_the_table() -> None:
    assert len(ROWS) == 4


@pytest.mark.parametrize("turned", [False, True], ids=["upright", "turned"])
@pytest.mark.parametrize("row", ROWS, ids="-".join)
def test_long_triangles_beside_the_origin(exact_renderer, row: tuple[str, ...], turned: bool
                                          ) -> None:
    height, sections = map(int, row[:2])
    mesh = trimesh.creation.cylinder(radius=1, height=height, sections=sections)
    origins, directions = rays_inside(height, sections)
    if turned:
        turn = trimesh.transformations.rotation_matrix(1.0, [1, 2, 0.5])
        mesh.apply_transform(turn)
        origins = trimesh.transform_points(origins, turn).astype(np.float32)
    truth = rt.reference.trace(mesh, origins, directions)
    with rt.Tracer(mesh, "brute-force") as tracer:
        hits = tracer.trace(origins, directions)
    assert truth.hit.all() and hits.hit.all()
    errors = np.abs(hits.t - truth.t) * np.linalg.norm(directions, axis=1)
    assert f"{errors.max():.2g}" == row[2 + turned]
    mesh.ray = RayMeshIntersector(mesh)
    assert mesh.contains(origins).all()
