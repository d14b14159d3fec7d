"""A replacement for trimesh's ray engines: ``mesh.ray = RayMeshIntersector(mesh, "kd-restart")``.

Names, arguments, shapes and the order of returned arrays are as in ``trimesh.ray``.
Differences:

* Hits are sorted by ray, then by (t, triangle), and include all hits on coincident triangles.
* Rays are traced in float32, which is too coarse far from the origin. A mesh farther from the
  origin than its size is therefore moved to the origin in float64. The position of a hit is
  computed in float64, from the mesh and the rays as given.
* A place is a point where a ray passes through the mesh. A place at an edge or a vertex has
  several triangles. ``intersects_location`` returns each place once, with its first triangle.
  ``intersects_id`` returns all triangles of a place, as trimesh's own engine does. With
  ``coincident=False``, it returns only the first triangle, as trimesh's Embree engine does.
* An invalid ray hits nothing. Multiplying directions by a power of two changes nothing.
"""
from __future__ import annotations

import os
import threading
from typing import Any

import numpy as np
import trimesh
from trimesh.ray.ray_util import contains_points

from .errors import Error, OptionError
from .methods import find_method
from .numerics.places import exact_t, first_hits_of_places
from .scene.scene import Scene, check_vertices
from .session.all_hits import AllHits
from .tracer import AUTO, DEFAULT_METHOD, Tracer


class RayMeshIntersector:
    """Answers ray queries on a mesh by a method of ``gpgpu_rt.methods()``.

    If the mesh changes, the next query uses the changed mesh. A pickled or copied intersector
    builds its own textures at its first query. A ray with a NaN, an infinity or a zero direction
    hits nothing.

    Parameters
    ----------
    mesh : trimesh.Trimesh
    method : a method's name, or "auto", as for ``Tracer``
    options : the options of ``Tracer`` and of the method
    coincident : whether ``intersects_id`` returns every triangle that a ray hits, or only the
        first triangle of each place

    Raises
    ------
    OptionError
        for a mesh that is not a trimesh.Trimesh, or an unknown method or option
    SceneError
        for a face's vertex that is not finite in float32. Queries raise ``Tracer``'s errors
    """

    def __init__(self, mesh: trimesh.Trimesh, method: str = DEFAULT_METHOD, *,
                 coincident: bool = True, **options: Any) -> None:
        if not isinstance(mesh, trimesh.Trimesh):
            raise OptionError(f"RayMeshIntersector traces a trimesh.Trimesh, not {_kind(mesh)}; "
                              f"give it {_advice(mesh)}")
        if method != AUTO:    # report a wrong option now, not at the first query
            find_method(method).resolved(options)
        check_vertices(_near_origin(mesh)[0], "mesh")
        self.mesh = mesh
        self.method, self.options, self.coincident = method, options, coincident
        self._forget()

    # Queries --------------------------------------------------------------------------------

    def intersects_id(self, ray_origins: np.ndarray, ray_directions: np.ndarray,
                      return_locations: bool = False, multiple_hits: bool = True,
                      max_hits: int | None = None) -> tuple[np.ndarray, ...]:
        """Return the triangles that rays hit.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
        return_locations : whether to return the positions of the hits, too
        multiple_hits : whether to return all hits of a ray, or only the first
        max_hits : return only this many of the nearest hits of each ray; with
            ``coincident=False``, this many of the nearest places. None returns all

        Returns
        -------
        index_tri : (m,) int64, rows of ``mesh.faces``
        index_ray : (m,) int64, ascending
        locations : (m, 3) float64, only with ``return_locations``
        """
        rays, most = (ray_origins, ray_directions), max_hits if multiple_hits else 1
        hits, places, locations = (self._hits(*rays, most, return_locations) if self.coincident
                                   else self._places(*rays, most))
        chosen = slice(None) if self.coincident else places
        found = hits.triangle[chosen].astype(np.int64), hits.ray[chosen]
        return (*found, locations[chosen]) if return_locations else found

    def intersects_location(self, ray_origins: np.ndarray, ray_directions: np.ndarray,
                            multiple_hits: bool = True, max_hits: int | None = None
                            ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the places where rays hit the mesh, each place once.

        Two hits of a ray belong to the same place, for example at an edge, if neither float32 nor
        float64 can separate the hits (`numerics/places.py`). The two sides of a thin sheet, seen
        from afar, are two places, because float64 separates them. If only float64 separates two
        places, this function returns the nearer place first, but ``intersects_first`` and
        ``max_hits=1`` may name the triangle of the other place.

        Parameters
        ----------
        ray_origins, ray_directions, multiple_hits : as for ``intersects_id``
        max_hits : at most this many of the nearest places per ray; None returns all

        Returns
        -------
        locations : (m, 3) float64
        index_ray : (m,) int64, ascending
        index_tri : (m,) int64, the triangle that float32 finds first at each place
        """
        hits, kept, locations = self._places(ray_origins, ray_directions,
                                             max_hits if multiple_hits else 1)
        return locations[kept], hits.ray[kept], hits.triangle[kept].astype(np.int64)

    def intersects_first(self, ray_origins: np.ndarray, ray_directions: np.ndarray) -> np.ndarray:
        """Return the first triangle that each ray hits, (n,) int64; -1 for a miss.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
        """
        with self._lock:
            origins, directions, tracer = self._prepared(ray_origins, ray_directions)
            hits = tracer.trace(origins, directions, invalid="miss")
        _check_status(hits.status)
        return hits.triangle.astype(np.int64)

    def intersects_any(self, ray_origins: np.ndarray, ray_directions: np.ndarray) -> np.ndarray:
        """Return whether each ray hits any triangle, (n,) bool.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
        """
        with self._lock:
            origins, directions, tracer = self._prepared(ray_origins, ray_directions)
            return tracer.occluded(origins, directions, invalid="miss")

    def contains_points(self, points: np.ndarray) -> np.ndarray:
        """Return whether each of the (n, 3) points lies inside the mesh, (n,) bool.

        The test of trimesh sends two opposite rays from each point: the point is inside if each
        ray hits an odd number of places. The result is undefined for points on the surface, and
        may be wrong if one of the rays grazes an outline.
        """
        return contains_points(self, points)

    # Parts of the queries -------------------------------------------------------------------

    def _places(self, origins: np.ndarray, directions: np.ndarray, most: int | None
                ) -> tuple[AllHits, np.ndarray, np.ndarray]:
        """Return the result of ``_hits`` for the nearest ``most`` places of each ray. The second
        array has only the rows of these places."""
        asked = most
        while True:
            hits, places, locations = self._hits(origins, directions, asked, True)
            if most is None or asked is None:
                return hits, places, locations
            found, cut = (np.bincount(rays, minlength=len(origins))
                          for rays in (hits.ray[places], hits.ray))
            if not ((found < most) & (cut >= asked)).any():
                rank = np.arange(len(places)) - (np.cumsum(found) - found)[hits.ray[places]]
                return hits, places[rank < most], locations
            asked *= 2      # a ray has fewer places than ``most`` and may have more hits

    def _hits(self, origins: np.ndarray, directions: np.ndarray, most: int | None, locate: bool
              ) -> tuple[AllHits, np.ndarray, np.ndarray]:
        """Return the nearest ``most`` hits of each ray; the row of each place's first hit, (k,);
        and all positions, (m, 3). Without ``locate``, rows and positions are empty."""
        with self._lock:
            origins, directions, tracer = self._prepared(origins, directions)
            hits = tracer.trace_all(origins, directions, invalid="miss", max_hits=most)
            rounded, moved = tracer.scene.triangles[hits.triangle], self._moved
            corners = np.asarray(self.mesh.vertices)[self.mesh.faces[hits.triangle]] - moved
        _check_status(hits.status)
        if not locate:
            return hits, np.zeros(0, np.int64), np.zeros((0, 3))
        origins, directions = origins[hits.ray], directions[hits.ray]
        with np.errstate(over="ignore"):
            places = first_hits_of_places(hits.ray, hits.t, rounded, origins.astype(np.float32),
                                          directions.astype(np.float32))
        t = exact_t(corners, origins, directions)
        return hits, places, origins + t[:, None] * directions + moved

    def _prepared(self, origins: np.ndarray, directions: np.ndarray
                  ) -> tuple[np.ndarray, np.ndarray, Tracer]:
        """Return origins and directions, (n, 3) float64 each, and the tracer of the mesh.

        Origins are relative to the moved mesh. A power of two scales the largest component of each
        direction into [0.5, 1).
        """
        origins, directions = (_rays_array(*given) for given in (
            (origins, "ray_origins"), (directions, "ray_directions")))
        if origins.shape != directions.shape:
            raise ValueError(f"ray_origins {origins.shape} and ray_directions "
                             f"{directions.shape} differ")
        # t is in units of the direction's length. For a very long or short direction, t would
        # overflow or underflow float32.
        directions = np.ldexp(directions, -np.frexp(
            np.abs(directions).max(axis=1, initial=0, keepdims=True))[1])
        tracer = self._current()
        return origins - self._moved, directions, tracer

    def _current(self) -> Tracer:
        if self._process != os.getpid():    # an OpenGL context cannot be used after a fork
            self._forget()
        shape, faces = hash(self.mesh), hash(self.mesh.faces)
        if self._tracer is not None and shape == self._shape:
            return self._tracer
        vertices, self._moved = _near_origin(self.mesh)
        if self._tracer is not None and faces == self._faces:
            self._tracer.update(vertices)
        else:
            self.release()
            scene = Scene.from_arrays(vertices, np.asarray(self.mesh.faces), name="mesh",
                                      source="trimesh")
            self._tracer = Tracer(scene, self.method, **self.options)
        self._shape, self._faces = shape, faces
        return self._tracer

    # Lifetime -------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._tracer: Tracer | None = None
        self._shape = self._faces = 0
        self._moved = np.zeros(3)
        self._lock = threading.RLock()
        self._process = os.getpid()

    def release(self) -> None:
        """Free textures and programs; the next query builds them again."""
        if self._tracer is not None and self._process == os.getpid():
            self._tracer.release()
        self._tracer = None

    def __enter__(self) -> RayMeshIntersector:
        return self

    def __exit__(self, *exception: object) -> None:
        self.release()

    def __getstate__(self) -> dict[str, Any]:
        return {"mesh": self.mesh, "method": self.method, "options": self.options,
                "coincident": self.coincident}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._forget()

    def __deepcopy__(self, memo: Any) -> RayMeshIntersector:
        """Return an intersector of the same mesh, as trimesh's own engines do.

        ``mesh.copy()`` gives the copy one of trimesh's engines; set the copy's ``ray`` again.
        """
        return self.__copy__()

    def __copy__(self) -> RayMeshIntersector:
        return type(self)(self.mesh, self.method, coincident=self.coincident, **self.options)


def _kind(given: object) -> str:
    return f"the text {given!r}" if isinstance(given, str) else f"a {type(given).__name__}"


def _advice(given: object) -> str:
    if isinstance(given, (str, os.PathLike)):
        return f"trimesh.load_mesh({os.fspath(given)!r})"
    return ("scene.to_mesh()" if isinstance(given, trimesh.Scene)
            else "trimesh.Trimesh(vertices, faces)")


def _rays_array(given: Any, name: str) -> np.ndarray:
    """Return rays as an (n, 3) float64 array."""
    try:
        rays = np.asanyarray(given, np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is not an array of numbers; give an array (n, 3)") from None
    if rays.shape == (0,):
        return rays.reshape(0, 3)
    if rays.ndim != 2 or rays.shape[1] != 3:
        raise ValueError(f"{name} has shape {rays.shape}; give an array (n, 3)")
    return rays


def _near_origin(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Return a mesh's vertices moved near the origin, (v, 3) float64, and the vector that was
    subtracted, (3,) float64.

    Along each axis, the vector is the mesh's centre if the centre is farther from 0 than the
    largest side of the mesh's box: float32 would round such vertices coarsely. Otherwise the
    vector is 0.
    A vertex without a face does not count: another vertex replaces it.
    """
    vertices, faces = np.array(mesh.vertices, np.float64), np.asarray(mesh.faces)
    used = np.zeros(len(vertices), bool)
    used[faces[(faces >= 0) & (faces < len(vertices))]] = True
    vertices[~used] = vertices[used.argmax()] if used.any() else 0
    if not len(vertices) or not np.isfinite(vertices).all():
        return vertices, np.zeros(3)
    lo, hi = vertices.min(axis=0), vertices.max(axis=0)
    centre = (lo + hi) / 2
    moved = np.where(np.abs(centre) > (hi - lo).max(), centre, 0.0)
    return vertices - moved, moved


def _check_status(status: np.ndarray) -> None:
    """Raise an error for stopped rays, which may have more or nearer hits."""
    stopped = int((status > 1).sum())
    if stopped:
        raise Error(f"{stopped} rays were stopped before their search ended; raise step_cap or "
                    "stack_size")


__all__ = ("RayMeshIntersector",)
