"""A drop-in for trimesh's ray engines: ``mesh.ray = RayMeshIntersector(mesh, "kd-restart")``.

Names, arguments, shapes and the order of results are those of ``trimesh.ray``. The differences:

* The hits of a ray are sorted by (t, triangle), ray after ray. The search for the next hit
  continues exactly behind the last hit (see ``session/all_hits.py``), so it finds all coincident
  triangles and skips no triangle.
* Intersection is computed in float32. A mesh that is far from the origin for its size is first
  moved to the origin in float64. The position of a hit on its ray is then computed in float64.
* ``intersects_location`` returns each place once: where a ray passes through several triangles at
  the same place, such as an edge, the first triangle is kept. ``intersects_id`` returns all of
  them, as trimesh's own engine does. With ``coincident=False`` it returns the first triangle of
  each place, as trimesh's Embree engine does.
* A ray hits nothing if its origin or direction is not finite, or if its direction is zero. The
  length of a direction has no effect, for any length that float64 holds.
"""
from __future__ import annotations

import os
import threading
from typing import Any

import numpy as np
import trimesh
from trimesh.ray.ray_util import contains_points

from .errors import Error
from .methods import find_method
from .numerics.error_bounds import FLOAT32, FLOAT64, bound_pairs
from .scene.scene import Scene
from .session.all_hits import AllHits
from .tracer import AUTO, DEFAULT_METHOD, Tracer


class RayMeshIntersector:
    """Ray queries on a mesh by a method of ``gpgpu_rt.methods()``.

    A change of the mesh is detected as trimesh detects it: the next query uses the changed mesh.
    An intersector can be pickled and copied; the copy builds its own textures at its first query.

    Parameters
    ----------
    mesh : trimesh.Trimesh
    method, options : as for ``Tracer``: a method's name, or "auto"
    coincident : whether ``intersects_id`` returns every triangle that a ray hits, or only the
        first triangle of each place

    Raises
    ------
    OptionError
        for an unknown method or option; queries raise the errors of ``Tracer``
    """

    def __init__(self, mesh: trimesh.Trimesh, method: str = DEFAULT_METHOD, *,
                 coincident: bool = True, **options: Any) -> None:
        if method != AUTO:    # report a wrong option now, not at the first query
            find_method(method).resolved(options)
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
        max_hits : the number of nearest hits per ray (of places, with ``coincident=False``); None
            for all

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

        Hits at the triangles around an edge or a vertex are a single place, and so are hits at
        coincident triangles. Two hits of a ray are the same place if the bounds of
        ``numerics/error_bounds.py`` allow their float32 t to be equal. They are two places if
        float64 separates them and proves that the ray hits both: a thin sheet seen from afar has
        two sides.

        Parameters
        ----------
        ray_origins, ray_directions, multiple_hits : as for ``intersects_id``
        max_hits : the number of nearest places per ray; None for all

        Returns
        -------
        locations : (m, 3) float64
        index_ray : (m,) int64, ascending
        index_tri : (m,) int64, the first triangle of each place in the order of (t, triangle)
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
        """Return whether each of the (n, 3) points lies inside, (n,) bool; undefined on the
        surface.

        The test is trimesh's own: the parity of the number of places that rays to both sides hit.
        """
        return contains_points(self, points)

    # Parts of the queries -------------------------------------------------------------------

    def _places(self, origins: np.ndarray, directions: np.ndarray, most: int | None
                ) -> tuple[AllHits, np.ndarray, np.ndarray]:
        """Return what ``_hits`` returns, for the nearest ``most`` places of each ray."""
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
        """Return the nearest ``most`` hits of each ray, the rows of the hits that begin a place
        (k,), and the positions of all hits (m, 3). Without ``locate`` the last two are empty."""
        with self._lock:
            origins, directions, tracer = self._prepared(origins, directions)
            hits = tracer.trace_all(origins, directions, invalid="miss", max_hits=most)
            triangles, moved = tracer.scene.triangles[hits.triangle], self._moved
        _check_status(hits.status)
        if not locate:
            return hits, np.zeros(0, np.int64), np.zeros((0, 3))
        origins, directions = origins[hits.ray], directions[hits.ray]
        with np.errstate(over="ignore"):
            pairs = (triangles, origins.astype(np.float32), directions.astype(np.float32))
            bounds, sharp = (bound_pairs(*pairs, arithmetic) for arithmetic in (FLOAT32, FLOAT64))
        # Intersect the triangle's plane in float64, and stay within float32's error bound on t: a
        # ray that lies nearly in the plane would otherwise get an arbitrary t.
        t = hits.t.astype(np.float64)
        reach = np.where(np.isfinite(bounds.t_bound), bounds.t_bound, 0)
        exact = np.where(np.isfinite(bounds.t), bounds.t, t)
        exact = np.clip(exact, t - reach, t + reach)
        blurred = np.cumsum(_begins(hits.ray, t, reach))
        places = _places(blurred, exact, np.where(sharp.possible, sharp.t_bound, np.inf))
        return hits, places, origins + exact[:, None] * directions + moved

    def _prepared(self, origins: np.ndarray, directions: np.ndarray
                  ) -> tuple[np.ndarray, np.ndarray, Tracer]:
        """Return origins and directions, (n, 3) float64 each, and the tracer of the mesh.

        Origins are relative to the moved mesh. Each direction is scaled by a power of two, so that
        its largest component lies in [0.5, 1).
        """
        origins, directions = (_rays_array(*given) for given in (
            (origins, "ray_origins"), (directions, "ray_directions")))
        if origins.shape != directions.shape:
            raise ValueError(f"ray_origins {origins.shape} and ray_directions "
                             f"{directions.shape} differ")
        # t is in units of the direction's length. With a very long or short direction, t would
        # exceed the range of float32 and all hits would get the same t.
        directions = np.ldexp(directions, -np.frexp(
            np.abs(directions).max(axis=1, initial=0, keepdims=True))[1])
        tracer = self._current()
        return origins - self._moved, directions, tracer

    def _current(self) -> Tracer:
        """Return the tracer of the mesh in its present state."""
        if self._process != os.getpid():    # an OpenGL context cannot be used after a fork
            self._forget()
        shape, faces = hash(self.mesh), hash(self.mesh.faces)
        if self._tracer is not None and shape == self._shape:
            return self._tracer
        vertices = np.asarray(self.mesh.vertices, np.float64)
        self._moved = _far_centre(vertices)
        vertices = vertices - self._moved
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
        """Free the textures and programs; the next query builds them again."""
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

        ``mesh.copy()`` gives the copied mesh one of trimesh's engines: set its ``ray`` again.
        """
        return self.__copy__()

    def __copy__(self) -> RayMeshIntersector:
        return type(self)(self.mesh, self.method, coincident=self.coincident, **self.options)


def _rays_array(given: Any, name: str) -> np.ndarray:
    """Return rays as an (n, 3) float64 array; an empty list becomes (0, 3)."""
    try:
        rays = np.asanyarray(given, np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is not an array of numbers; give an array (n, 3)") from None
    if rays.shape == (0,):
        return rays.reshape(0, 3)
    if rays.ndim != 2 or rays.shape[1] != 3:
        raise ValueError(f"{name} has shape {rays.shape}; give an array (n, 3)")
    return rays


def _far_centre(vertices: np.ndarray) -> np.ndarray:
    """Return the offset that moves (v, 3) vertices near the origin, (3,) float64.

    The offset is the centre along each axis where the centre is farther from 0 than the mesh is
    large, else 0. Far from 0, float32 would round the vertices coarsely.
    """
    if not len(vertices) or not np.isfinite(vertices).all():
        return np.zeros(3)
    lo, hi = vertices.min(axis=0), vertices.max(axis=0)
    centre = (lo + hi) / 2
    return np.where(np.abs(centre) > (hi - lo).max(), centre, 0.0)


def _begins(group: np.ndarray, t: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return whether each hit begins a new place, (m,) bool.

    A hit begins a place if its group differs from the group of the hit before, or if the intervals
    t - reach to t + reach of the two hits are disjoint.
    """
    new = np.ones(len(t), bool)
    new[1:] = (np.diff(group) > 0) | (t[1:] - reach[1:] > t[:-1] + reach[:-1])
    return new


def _places(blurred: np.ndarray, t: np.ndarray, sharp: np.ndarray) -> np.ndarray:
    """Return the rows of the hits that begin a place, (k,), ray by ray and nearest first.

    Parameters
    ----------
    blurred : (m,) int, ascending: the number of the place, as far as float32 can tell
    t : (m,) float64, where the ray of a hit meets the triangle's plane
    sharp : (m,) float64, error bound of t in float64; inf where float64 proves that the ray misses
        the triangle. Such a hit counts only if float64 confirms no other hit of its ``blurred``
        place
    """
    order = np.lexsort((t, ~np.isfinite(sharp), blurred))
    group, t, sharp = blurred[order], t[order], sharp[order]
    known = np.isfinite(sharp)
    first = np.r_[True, np.diff(group) > 0][:len(group)]
    stands = known == known[np.flatnonzero(first)[np.cumsum(first) - 1]]
    places = np.cumsum(first | known & _begins(group, t, np.where(known, sharp, 0)))
    # Choose for each place the hit that comes first in the given order; places stay sorted by t.
    rows = np.full(places[-1] if len(places) else 0, len(order))
    np.minimum.at(rows, places[stands] - 1, order[stands])
    return rows


def _check_status(status: np.ndarray) -> None:
    """Raise an error if rays were stopped, because they may have more hits, or nearer hits."""
    stopped = int((status > 1).sum())
    if stopped:
        raise Error(f"{stopped} rays were stopped before their search ended; raise step_cap or "
                    "stack_size")


__all__ = ("RayMeshIntersector",)
