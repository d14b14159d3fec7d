"""A pytest plugin for trimesh's own tests: it replaces trimesh's ray engines by our intersector.

The file test_trimeshs_own_tests.py runs the plugin in a separate process, because the replacement
cannot be undone. The source distribution of trimesh lacks the tests' common module and meshes, so
this file provides substitutes.
"""
from __future__ import annotations

import importlib.util
import logging
import os
import sys
import tempfile
import time
import types
from pathlib import Path

import numpy as np
import trimesh

from gpgpu_rt.trimesh_ray import RayMeshIntersector

METHOD = os.environ.get("OURS_IN_TRIMESH", "bvh-threaded")
asked = 0  # queries that our intersector answered


class Counting(RayMeshIntersector):
    """Counts queries, because a run without queries would prove nothing."""

    def _current(self):
        global asked
        asked += 1
        return super()._current()


class AsNative(Counting):
    """Accepts the arguments of trimesh's own engine."""

    def __init__(self, mesh):
        super().__init__(mesh, METHOD)

    def __copy__(self):
        return AsNative(self.mesh)


class AsEmbree(Counting):
    """Accepts the arguments of the Embree engine, and reports only one triangle per location, as
    the Embree engine does."""

    def __init__(self, geometry, scale_to_box=True):
        super().__init__(geometry, METHOD, coincident=False)

    def __copy__(self):
        return AsEmbree(self.mesh)


def pytest_configure(config) -> None:
    trimesh.ray.ray_triangle.RayMeshIntersector = AsNative
    trimesh.ray.ray_pyembree.RayMeshIntersector = AsEmbree
    if importlib.util.find_spec("generic") is None:
        sys.modules["generic"] = stand_in()


def pytest_terminal_summary(terminalreporter) -> None:
    terminalreporter.write_line(f"queries answered by gpgpu_rt: {asked}")


def stand_in() -> types.ModuleType:
    """Returns a substitute for trimesh's module `generic`, with the members that the ray tests
    use."""
    folder = Path(tempfile.mkdtemp(prefix="meshes"))
    for name, mesh in meshes().items():
        mesh.export(folder / name)
    module = types.ModuleType("generic")
    module.np, module.trimesh, module.time = np, trimesh, time
    module.log = logging.getLogger("trimesh")
    module.random = np.random.default_rng(0).random

    def get_mesh(file_name: str, **more) -> trimesh.Trimesh:
        mesh = trimesh.load_mesh(folder / file_name, **more)
        mesh.source.file_path = str(folder / file_name)
        return mesh

    module.get_mesh = get_mesh
    module.data = {"ray_data": {
        "load_kwargs": [{"file_name": name, "use_embree": embree}
                        for name in meshes() for embree in (True, False)],
        "rays": {name: rays(mesh) for name, mesh in meshes().items()}}}
    return module


def meshes() -> dict[str, trimesh.Trimesh]:
    """Returns substitutes for trimesh's meshes of the same names: a cube, a ball, a cube without
    one octant, a mesh with holes, and a part with a bore."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    open_pot = trimesh.Trimesh(10 * ball.vertices, ball.faces[40:], process=False)
    return {"unit_cube.STL": trimesh.creation.box(), "unit_sphere.STL": ball,
            "7_8ths_cube.stl": seven_eighths(10.0), "teapot.stl": open_pot,
            "featuretype.STL": trimesh.creation.annulus(r_min=0.5, r_max=2, height=1)}


def seven_eighths(half: float) -> trimesh.Trimesh:
    """Returns a cube around the origin without the octant of positive x, y and z.

    The cube consists of filled cells. A face lies between a filled cell and an empty cell.
    """
    filled = np.zeros((4, 4, 4), bool)
    filled[1:3, 1:3, 1:3] = True
    filled[2, 2, 2] = False
    corners, faces = [], []
    for axis in range(3):
        step = np.eye(3, dtype=int)[axis]
        across, up = np.roll(step, 1), np.roll(step, 2)
        for cell in np.argwhere(np.diff(filled.astype(int), axis=axis)):
            leaves = filled[tuple(cell)]
            at = cell + step - 2
            order = (at, at + across, at + across + up, at + up)
            faces += [np.array(f) + len(corners) for f in ((0, 1, 2), (0, 2, 3))]
            corners += order if leaves else order[::-1]
    made = trimesh.Trimesh(half * np.array(corners, float), faces)
    assert made.is_watertight and np.isclose(made.volume, 7 * half ** 3)
    return made


def rays(mesh: trimesh.Trimesh, count: int = 500) -> dict[str, np.ndarray]:
    """Returns rays from points around a mesh in all directions."""
    rng = np.random.default_rng(len(mesh.faces))
    return {"ray_origins": mesh.bounds.mean(0) + mesh.scale * rng.uniform(-1, 1, (count, 3)),
            "ray_directions": rng.normal(size=(count, 3))}
