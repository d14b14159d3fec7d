"""Engines: other ray tracers of today, with which this package is compared on the same rays.

An engine that is not installed or cannot be imported is left out, and the bench reports why.
"""
from __future__ import annotations

import functools
import importlib
import importlib.metadata
import importlib.util
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import trimesh

from ..scene.scene import Scene
from ..text_format import counted
from ..threads import cores
from . import embree_in_c
from .workloads import Workload

# Traces all rays. Returns (n,) int, triangles or -1; with `any_hit`, (n,) bool, whether rays hit.
Run = Callable[[], np.ndarray]
CORES = cores()
# Rays in a block for trimesh's own engine. The engine holds all triangle tests of a block in
# memory: in a room, tens of thousands for each ray.
BLOCK = 32


@dataclass(frozen=True)
class Engine:
    """An engine, run with a fixed number of threads.

    Attributes
    ----------
    name : The name in tables.
    modules : The Python modules that the engine needs.
    prepare : Function of (scene, rays) that builds the engine's structure and returns a function
        that traces the rays.
    most : A slow engine traces only this number of rays, spread evenly over all rays; None: all.
    ends : Whether the engine accepts rays with an end, such as shadow rays.
    threads : Number of threads.
    tile : Size of the image's tiles in pixels. The engine gets the rays tile by tile.
    robust : Whether the engine promises that no ray leaks at an edge or vertex.
    absent : Function that returns the reason why the engine cannot run, or "". None: the engine
        runs if ``modules`` can be imported.
    """

    name: str
    modules: tuple[str, ...]
    prepare: Callable[[Scene, Workload], Run]
    most: int | None = None
    ends: bool = True
    threads: int = 1
    tile: tuple[int, int] = (1, 1)
    robust: bool = True
    absent: Callable[[], str] | None = None

    @property
    def missing(self) -> str:
        """The reason why the engine cannot run, such as "embreex is not installed"; "" if it
        can."""
        if self.absent is not None:
            return self.absent()
        return next(filter(None, map(_absent, self.modules)), "")


@functools.cache     # a second failed import would take as long as the first
def _absent(module: str) -> str:
    """Return the reason why a module cannot be imported; "" if it can be imported."""
    package = module.partition(".")[0]
    if importlib.util.find_spec(package) is None:
        return f"{package} is not installed"
    try:
        importlib.import_module(module)
    except Exception as failure:    # a package that lacks a library may raise any exception
        reason = " ".join(str(failure).split())[:160]
        return f"{package} cannot be imported ({type(failure).__name__}: {reason})"
    return ""


def _embree(threads: int) -> Callable[[Scene, Workload], Run]:
    def prepare(scene: Scene, rays: Workload) -> Run:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh
        embree = rtcore_scene.EmbreeScene()
        TriangleMesh(embree, np.ascontiguousarray(scene.triangles, np.float32))
        parts = [tuple(map(np.ascontiguousarray, part)) for part in zip(
            *(np.array_split(array, threads) for array in (rays.origins, rays.directions,
                                                           rays.ends)))]

        def trace(part: tuple[np.ndarray, ...]) -> np.ndarray:
            origins, directions, ends = part
            if rays.any_hit:
                return embree.run(origins, directions, dists=ends, query="OCCLUDED") == 0
            return embree.run(origins, directions)
        if threads == 1:
            return lambda: trace(parts[0])

        def run() -> np.ndarray:
            with ThreadPoolExecutor(threads) as pool:
                return np.concatenate(list(pool.map(trace, parts)))
        return run
    return prepare


def _trimesh(scene: Scene, rays: Workload) -> Run:
    """Prepare trimesh's own engine, an R-tree of boxes with triangle tests in numpy."""
    from trimesh.ray.ray_triangle import RayMeshIntersector
    mesh = trimesh.Trimesh(np.reshape(scene.triangles, (-1, 3)),
                           np.arange(3 * len(scene)).reshape(-1, 3), process=False)
    engine = RayMeshIntersector(mesh)
    blocks = range(0, len(rays.origins), BLOCK)
    return lambda: np.concatenate([engine.intersects_first(
        rays.origins[at:at + BLOCK], rays.directions[at:at + BLOCK]) for at in blocks])


def _open3d(threads: int) -> Callable[[Scene, Workload], Run]:
    def prepare(scene: Scene, rays: Workload) -> Run:
        import open3d
        tensor = open3d.core.Tensor
        engine = open3d.t.geometry.RaycastingScene(nthreads=threads)
        engine.add_triangles(
            tensor(np.ascontiguousarray(scene.triangles, np.float32).reshape(-1, 3)),
            tensor(np.arange(3 * len(scene), dtype=np.uint32).reshape(-1, 3)))
        # Open3D has a single end for all rays: scale each direction so that its ray ends at 1.
        scale = rays.ends[:, None] if rays.any_hit else np.float32(1)

        def run() -> np.ndarray:
            both = tensor(np.concatenate([rays.origins, rays.directions * scale], axis=1))
            if rays.any_hit:
                return engine.test_occlusions(both, tfar=1.0, nthreads=threads).numpy()
            hits = engine.cast_rays(both, nthreads=threads)
            return hits["primitive_ids"].numpy().view(np.int32)
        return run
    return prepare


def _mitsuba(threads: int) -> Callable[[Scene, Workload], Run]:
    def prepare(scene: Scene, rays: Workload) -> Run:
        import drjit
        import mitsuba
        mitsuba.set_variant("llvm_ad_rgb")
        mesh = mitsuba.Mesh("scene", vertex_count=3 * len(scene), face_count=len(scene))
        fields = mitsuba.traverse(mesh)
        fields["vertex_positions"] = np.asarray(scene.triangles, np.float32).ravel()
        fields["faces"] = np.arange(3 * len(scene), dtype=np.uint32)
        fields.update()
        engine = mitsuba.load_dict({"type": "scene", "mesh": mesh})

        def run() -> np.ndarray:
            drjit.set_thread_count(threads)
            both = mitsuba.Ray3f(mitsuba.Point3f(rays.origins.T),
                                 mitsuba.Vector3f(rays.directions.T))
            if rays.any_hit:
                both.maxt = mitsuba.Float(rays.ends)
                return np.array(engine.ray_test(both))
            hits = engine.ray_intersect_preliminary(both)
            return np.where(np.isfinite(np.array(hits.t)),
                            np.array(hits.prim_index, np.int64), -1)
        return run
    return prepare


def _named_version(package: str) -> str:
    """Return the name of a Python package, with its version if it is installed."""
    try:
        return f"{package} {importlib.metadata.version(package)}"
    except importlib.metadata.PackageNotFoundError:
        return package


_NAMES = [_named_version(package) for package in ("embreex", "trimesh", "open3d", "mitsuba")]
EMBREE = f"{_NAMES[0]}, one thread"     # the baseline of all ratios
OWN = f"{_NAMES[1]}'s own"
_EMBREEX = ("embreex.rtcore_scene", "embreex.mesh_construction")

_IN_C = f"Embree {embree_in_c.version()}".rstrip()
_TILES = {16: (4, 4), 8: (4, 2), 1: (1, 1)}     # rays of a packet -> pixels that the packet covers
_ALL = [CORES] if CORES > 1 else []     # numbers of threads besides 1

ENGINES = (
    Engine(EMBREE, _EMBREEX, _embree(1)),
    *(Engine(f"{_NAMES[0]}, {n} threads", _EMBREEX, _embree(n), threads=n) for n in _ALL),
    *(Engine(f"{_IN_C} in C, packets of {width}, {counted(CORES, 'thread')}" if width > 1 else
             f"{_IN_C} in C, {counted(CORES, 'thread')}", (), embree_in_c.packets(width, CORES),
             threads=CORES, tile=tile, absent=embree_in_c.missing)
      for width, tile in _TILES.items()),
    Engine(OWN, ("rtree",), _trimesh, most=128, ends=False, robust=False),
    Engine(f"{_NAMES[2]}, one thread", ("open3d",), _open3d(1)),
    *(Engine(f"{_NAMES[2]}, {n} threads", ("open3d",), _open3d(n), threads=n) for n in _ALL),
    Engine(f"{_NAMES[3]}, {CORES} threads", ("mitsuba", "drjit"), _mitsuba(CORES), threads=CORES,
           robust=False),
)
