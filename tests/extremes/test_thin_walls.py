"""Checks docs/extremes.md: the errors of t for rays at long thin triangles."""
from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

import gpgpu_rt as rt
from gpgpu_rt.numerics.places import exact_t
from gpgpu_rt.trimesh_ray import RayMeshIntersector

PAGE = Path(rt.__file__).parents[1] / "docs" / "extremes.md"
ROWS = re.findall(r"\| (\d+) \| (\d+) \| ([\d.e-]+) \| ([\d.e-]+) \|",
                  PAGE.read_text(encoding="utf-8"))
BOXES = re.findall(r"\| (\d+) x ([\d.]+) x [\d.]+ \| (\S+) \| (\S+) \| (\S+) \|",
                   PAGE.read_text(encoding="utf-8"))
RAYS, RAYS_AT_BOX = 4000, 100_000


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


def test_the_page_has_the_tables() -> None:
    assert len(ROWS) == 4 and len(BOXES) == 3


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


@pytest.mark.parametrize("row", BOXES, ids="-".join)
def test_thin_boxes_seen_from_outside(exact_renderer, row: tuple[str, ...]) -> None:
    length, width = map(float, row[:2])
    mesh = trimesh.creation.box(extents=(length, width, width))
    mesh.apply_transform(trimesh.transformations.euler_matrix(0.5, 0.7, 0.9))
    vertices, rng = np.float32(mesh.vertices), np.random.default_rng(3)
    corners = vertices[mesh.faces].astype(np.float64)
    weights, face = rng.dirichlet((1, 1, 1), RAYS_AT_BOX), rng.integers(0, 12, RAYS_AT_BOX)
    aims = np.einsum("kc,kcd->kd", weights, corners[face])
    origins = np.float32(aims + rng.normal(size=aims.shape) * length / 4)
    directions = np.float32(aims - origins)
    with rt.Tracer(rt.Scene.from_arrays(vertices, mesh.faces), "bvh-threaded") as tracer:
        hits = tracer.trace(origins, directions)
    hit = hits.hit
    assert hit.mean() > 0.98        # rounding moves some origins by more than the box's width
    truth = exact_t(corners[hits.triangle[hit]], origins[hit].astype(np.float64),
                    directions[hit].astype(np.float64))
    errors = np.abs(hits.t[hit] - truth) * np.linalg.norm(directions[hit], axis=1)
    found = np.median(errors), np.quantile(errors, 0.99), errors.max()
    assert [f"{error:.2g}" for error in found] == list(row[2:])
