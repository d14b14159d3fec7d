"""Engines: calls the ray tracers that people install, all through the type `Trace`.

Every engine is optional, and is imported only in the process that runs it. A wrapper is an engine
that calls another engine of this table. A wrapper's wrong answer is its own error if the wrapped
engine is also tested and answers the ray correctly.
"""
from __future__ import annotations

import importlib.metadata
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import warp_kernel
from .answers import EngineAnswers, Trace, of_distances
from .case import Case

NEGATIVE = "negative t_min"     # Embree does not accept a negative t_min
ALL_T = (NEGATIVE, "t_min", "t_max")


@dataclass(frozen=True)
class Adapter:
    """An engine of the table.

    Attributes
    ----------
    name : the name on the command line and in tables
    package : the distribution whose version is printed
    modules : the modules that must be installed
    prepare : imports the engine, and returns the function that traces a case
    wraps : the engine that this engine calls, or ""
    ends : the members of ALL_T that the engine accepts: "t_min" for a t_min other than 0, "t_max"
        for a finite t_max, NEGATIVE for a negative t_min
    most : the largest number of rays per family that a slow engine traces
    """

    name: str
    package: str
    modules: tuple[str, ...]
    prepare: Callable[[], Trace]
    wraps: str = ""
    ends: tuple[str, ...] = ()
    most: int = 1 << 30

    @property
    def version(self) -> str:
        """The version of the package; "" if it is not installed."""
        try:
            return importlib.metadata.version(self.package) if self.package else ""
        except importlib.metadata.PackageNotFoundError:
            return ""

    @property
    def missing(self) -> str:
        """Why the engine cannot run; "" if it can."""
        for module in self.modules:
            if importlib.util.find_spec(module) is None:
                return f"{self.package} is not installed"
        return ""

    def traces(self, case: Case) -> bool:
        begins, ends = bool((case.t_min != 0).any()), bool((case.t_max != np.inf).any())
        return ((not begins or "t_min" in self.ends) and (not ends or "t_max" in self.ends)
                and (case.t_min.min(initial=0) >= 0 or NEGATIVE in self.ends))


def _mesh(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (3 m, 3) float32 and faces (m, 3) int32; triangles share no vertices."""
    corners = np.ascontiguousarray(case.triangles).reshape(-1, 3)
    return corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3)


def _ends(case: Case) -> tuple[np.ndarray, np.ndarray]:
    n = len(case.origins)
    return tuple(np.ascontiguousarray(np.broadcast_to(end, n)) for end in (case.t_min, case.t_max))


def _finite_ends(case: Case) -> np.ndarray:
    """Return t_max, (n,) float32, for engines that multiply by t_max: the largest float32 replaces
    infinity."""
    return np.minimum(_ends(case)[1], np.finfo(np.float32).max)


def _embreex() -> Trace:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    def trace(case: Case) -> EngineAnswers:
        scene = EmbreeScene()
        TriangleMesh(scene, case.triangles)
        n = len(case.origins)
        # embreex has no t_min, and its rays end at 1e37.
        ends = np.minimum(_ends(case)[1], np.float32(1e37))
        found = scene.run(case.origins, case.directions, dists=ends.copy(), output=True)
        any_hit = scene.run(case.origins, case.directions, dists=ends.copy(), query="OCCLUDED")
        triangle = found["primID"] if n else np.zeros(0, int)
        return EngineAnswers(triangle, found["tfar"], any_hit == 0)
    return trace


def _trimesh(engine: str) -> Callable[[], Trace]:
    def prepare() -> Trace:
        import trimesh
        module = importlib.import_module(f"trimesh.ray.{engine}")

        def trace(case: Case) -> EngineAnswers:
            mesh = trimesh.Trimesh(*_mesh(case), process=False)
            rays = module.RayMeshIntersector(mesh)
            # trimesh returns no t, and its functions may find different hits. Judge
            # `intersects_first`, which people use for visibility.
            return EngineAnswers(rays.intersects_first(case.origins, case.directions), None,
                                 rays.intersects_any(case.origins, case.directions))
        return trace
    return prepare


def _open3d() -> Trace:
    import open3d

    def trace(case: Case) -> EngineAnswers:
        tensor, (vertices, faces) = open3d.core.Tensor, _mesh(case)
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(tensor(vertices), tensor(faces.astype(np.uint32)))
        rays = tensor(np.concatenate([case.origins, case.directions], axis=1))
        found = scene.cast_rays(rays)
        triangle = found["primitive_ids"].numpy().astype(np.int64)
        triangle[triangle == 0xffffffff] = -1
        return of_distances(case, found["t_hit"].numpy(), triangle,
                            scene.test_occlusions(rays).numpy()
                            if not (case.t_max != np.inf).any() else None)
    return trace


def _mitsuba() -> Trace:
    import mitsuba
    mitsuba.set_variant("llvm_ad_rgb")

    def trace(case: Case) -> EngineAnswers:
        vertices, faces = _mesh(case)
        mesh = mitsuba.Mesh("case", vertex_count=len(vertices), face_count=len(faces))
        fields = mitsuba.traverse(mesh)
        fields["vertex_positions"], fields["faces"] = vertices.ravel(), faces.ravel()
        fields.update()
        scene = mitsuba.load_dict({"type": "scene", "mesh": mesh})
        rays = mitsuba.Ray3f(mitsuba.Point3f(case.origins.T), mitsuba.Vector3f(case.directions.T))
        rays.maxt = mitsuba.Float(_finite_ends(case))
        found = scene.ray_intersect_preliminary(rays)
        t = np.array(found.t)
        return EngineAnswers(np.where(np.isfinite(t), np.array(found.prim_index, np.int64), -1), t,
                             np.array(scene.ray_test(rays)))
    return trace


def _libigl() -> Trace:
    import igl.embree

    def trace(case: Case) -> EngineAnswers:
        scene = igl.embree.EmbreeIntersector()
        vertices, faces = _mesh(case)
        scene.init(vertices, faces)
        found = [scene.intersectRay_first(o, d, first, last) for o, d, first, last in zip(
            case.origins, case.directions, *(end.tolist() for end in _ends(case)))]
        return EngineAnswers(np.array([one[0] for one in found], np.int64),
                             np.array([one[1] for one in found]))
    return trace


def _point_cloud_utils() -> Trace:
    import point_cloud_utils

    def trace(case: Case) -> EngineAnswers:
        found = point_cloud_utils.ray_mesh_intersection(
            *_mesh(case), case.origins, case.directions)
        return of_distances(case, found[2], found[0])
    return trace


def _vtk() -> Trace:
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

    def trace(case: Case) -> EngineAnswers:
        vertices, faces = _mesh(case)
        points, cells, data = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
        points.SetData(numpy_to_vtk(vertices, deep=True))
        sized = np.column_stack([np.full(len(faces), 3), faces]).astype(np.int64).ravel()
        cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(sized, deep=True))
        data.SetPoints(points)
        data.SetPolys(cells)
        locator = vtk.vtkStaticCellLocator()
        locator.SetDataSet(data)
        locator.BuildLocator()
        t, place, inside = vtk.mutable(0.0), [0.0] * 3, [0.0] * 3
        part, cell = vtk.mutable(0), vtk.mutable(0)
        # VTK intersects segments: a segment ends beyond the scene, or at t_max.
        directions = case.directions.astype(np.float64)
        length = np.linalg.norm(directions, axis=1)
        size = np.abs(vertices).max(initial=0) + np.abs(case.origins).max(axis=1, initial=0)
        last = np.minimum(4 * size / length, _ends(case)[1])
        answers = []
        for o, end in zip(case.origins.tolist(),
                          (case.origins + last[:, None] * directions).tolist()):
            hit = locator.IntersectWithLine(o, end, 0.0, t, place, inside, part, cell)
            answers.append((int(cell), float(t)) if hit else (-1, np.inf))
        triangle, share = np.array(answers).reshape(-1, 2).T
        return EngineAnswers(triangle.astype(np.int64), share * last)
    return trace


def _fcpw() -> Trace:
    import fcpw

    def trace(case: Case) -> EngineAnswers:
        scene = fcpw.scene_3D()
        vertices, faces = (np.asfortranarray(array) for array in _mesh(case))
        scene.set_object_count(1)
        scene.set_object_vertices(vertices, 0)
        scene.set_object_triangles(faces, 0)
        scene.build(fcpw.aggregate_type.bvh_surface_area, True)
        rays = [np.asfortranarray(array) for array in (case.origins, case.directions)]
        found = fcpw.interaction_3D_list()
        scene.intersect(*rays, _finite_ends(case), found)
        triangle, t = np.array([(one.primitive_index, one.d) for one in found]).reshape(-1, 2).T
        return EngineAnswers(triangle.astype(np.int64), t)
    return trace


EMBREEX = "embreex"
ENGINES = {engine.name: engine for engine in (
    Adapter(EMBREEX, "embreex", ("embreex",), _embreex, ends=("t_max",)),
    Adapter("trimesh-embreex", "trimesh", ("trimesh", "embreex"), _trimesh("ray_pyembree"),
           wraps=EMBREEX),
    Adapter("trimesh", "trimesh", ("trimesh", "rtree"), _trimesh("ray_triangle"), most=500),
    Adapter("open3d", "open3d", ("open3d",), _open3d, ends=("t_max",)),
    Adapter("mitsuba", "mitsuba", ("mitsuba",), _mitsuba, ends=("t_max",)),
    Adapter("warp", "warp-lang", ("warp",), warp_kernel.prepare, ends=("t_max",)),
    Adapter("libigl", "libigl", ("igl",), _libigl, ends=("t_min", "t_max")),
    Adapter("point-cloud-utils", "point-cloud-utils", ("point_cloud_utils",), _point_cloud_utils,
           ends=("t_max",)),
    Adapter("vtk", "vtk", ("vtk",), _vtk, ends=("t_max",), most=500),
    Adapter("fcpw", "fcpw", ("fcpw",), _fcpw, ends=("t_max",)),
)}
