"""A drop-in for trimesh's ray engines: ``mesh.ray = RayMeshIntersector(mesh, "kd-restart")``.

Names, arguments, shapes and the order of what is returned are those of ``trimesh.ray``. What
differs is said here once:

* The hits of a ray come nearest first, by (t, triangle), ray after ray. A ray goes on behind a hit
  exactly (see ``session/all_hits.py``): triangles that coincide are all found, and none is stepped
  over.
* Rays and mesh meet in float32. A mesh that lies far from the origin for its size is moved there
  first, in float64. Where a hit lies on its ray is then computed in float64.
* ``intersects_location`` names a place once: of triangles that a ray passes through at one place,
  as at an edge, the first is kept. ``intersects_id`` names all of them, as trimesh's own engine
  does, and with ``coincident=False`` the first at each place, as its engine on Embree does.
* A ray whose origin or direction is not finite, or that has no direction, hits nothing. A
  direction's length does not count, whatever of float64's it is.
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
    """Ray queries of a mesh by one of the methods of ``gpgpu_rt.methods()``.

    A mesh that changes is noticed, as trimesh notices it: the next query takes it as it is then.
    It can be pickled and copied; the copy makes textures of its own when it is first asked.

    Parameters
    ----------
    mesh : trimesh.Trimesh
    method, options : as for ``Tracer``, a method's name among them and "auto"
    coincident : whether ``intersects_id`` names every triangle that a ray meets, or of those that
        it meets at one place the first alone

    Raises
    ------
    OptionError
        an unknown method or option; queries raise what ``Tracer`` does
    """

    def __init__(self, mesh: trimesh.Trimesh, method: str = DEFAULT_METHOD, *,
                 coincident: bool = True, **options: Any) -> None:
        if method != AUTO:    # or a mistake would show at the first query
            find_method(method).resolved(options)
        self.mesh = mesh
        self.method, self.options, self.coincident = method, options, coincident
        self._forget()

    # Queries --------------------------------------------------------------------------------

    def intersects_id(self, ray_origins: np.ndarray, ray_directions: np.ndarray,
                      return_locations: bool = False, multiple_hits: bool = True,
                      max_hits: int | None = None) -> tuple[np.ndarray, ...]:
        """The triangles that rays hit.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
        return_locations : say where, too
        multiple_hits : all hits of a ray, or its first one alone
        max_hits : of a ray, the nearest ones (places, with ``coincident=False``); None for all

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
        """The places where rays hit the mesh, each once: the triangles around an edge or a vertex
        are one, and so are two that coincide.

        Hits of a ray are one place where float32 cannot tell their t apart, by the bounds of
        ``numerics/error_bounds.py``, unless float64 can, and knows the ray to meet both: a thin
        sheet seen from afar has two sides.

        Parameters
        ----------
        ray_origins, ray_directions, multiple_hits : as for ``intersects_id``
        max_hits : of a ray, the nearest places; None for all

        Returns
        -------
        locations : (m, 3) float64
        index_ray : (m,) int64, ascending
        index_tri : (m,) int64, of each place the first in the order of (t, triangle)
        """
        hits, kept, locations = self._places(ray_origins, ray_directions,
                                             max_hits if multiple_hits else 1)
        return locations[kept], hits.ray[kept], hits.triangle[kept].astype(np.int64)

    def intersects_first(self, ray_origins: np.ndarray, ray_directions: np.ndarray) -> np.ndarray:
        """(n,) int64, the first triangle that each ray hits, -1 where there is none.

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
        """(n,) bool, whether each ray hits anything.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
        """
        with self._lock:
            origins, directions, tracer = self._prepared(ray_origins, ray_directions)
            return tracer.occluded(origins, directions, invalid="miss")

    def contains_points(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool, which of (n, 3) points lie inside; on the surface, either.

        trimesh's own way: the parity of the places that rays to both sides pass through.
        """
        return contains_points(self, points)

    # What they are made of ------------------------------------------------------------------

    def _places(self, origins: np.ndarray, directions: np.ndarray, most: int | None
                ) -> tuple[AllHits, np.ndarray, np.ndarray]:
        """As ``_hits`` gives it, of each ray the nearest ``most`` places."""
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
            asked *= 2      # what is left of some ray's hits are too few places

    def _hits(self, origins: np.ndarray, directions: np.ndarray, most: int | None, locate: bool
              ) -> tuple[AllHits, np.ndarray, np.ndarray]:
        """Of each ray the nearest ``most`` hits; where that is asked, the rows that begin a place,
        (k,), and where all hits lie, (m, 3)."""
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
        # Where the plane is met, as far as float32's t allows: one seen edge-on is met anywhere.
        t = hits.t.astype(np.float64)
        reach = np.where(np.isfinite(bounds.t_bound), bounds.t_bound, 0)
        exact = np.where(np.isfinite(bounds.t), bounds.t, t)
        exact = np.clip(exact, t - reach, t + reach)
        blurred = np.cumsum(_begins(hits.ray, t, reach))
        places = _places(blurred, exact, np.where(sharp.possible, sharp.t_bound, np.inf))
        return hits, places, origins + exact[:, None] * directions + moved

    def _prepared(self, origins: np.ndarray, directions: np.ndarray
                  ) -> tuple[np.ndarray, np.ndarray, Tracer]:
        """Rays, (n, 3) float64 each, seen from where the mesh was moved, directions with largest
        components in [0.5, 1); and its tracer."""
        origins, directions = (_rays_array(*given) for given in (
            (origins, "ray_origins"), (directions, "ray_directions")))
        if origins.shape != directions.shape:
            raise ValueError(f"ray_origins {origins.shape} and ray_directions "
                             f"{directions.shape} differ")
        # In units of a direction's length t may be past what float32 holds, and all hits be one.
        directions = np.ldexp(directions, -np.frexp(
            np.abs(directions).max(axis=1, initial=0, keepdims=True))[1])
        tracer = self._current()
        return origins - self._moved, directions, tracer

    def _current(self) -> Tracer:
        """The tracer of the mesh as it is now."""
        if self._process != os.getpid():    # a context does not outlive a fork
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
        """Free textures and programs; the next query makes them again."""
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
        """Of the same mesh, as trimesh's own do. (``mesh.copy()`` gives the copy an engine of
        trimesh's: set its ``ray`` again.)"""
        return self.__copy__()

    def __copy__(self) -> RayMeshIntersector:
        return type(self)(self.mesh, self.method, coincident=self.coincident, **self.options)


def _rays_array(given: Any, name: str) -> np.ndarray:
    """(n, 3) float64; an empty list is none."""
    try:
        rays = np.asanyarray(given, np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} are no array of numbers; give (n, 3)") from None
    if rays.shape == (0,):
        return rays.reshape(0, 3)
    if rays.ndim != 2 or rays.shape[1] != 3:
        raise ValueError(f"{name} have shape {rays.shape}; give (n, 3)")
    return rays


def _far_centre(vertices: np.ndarray) -> np.ndarray:
    """(3,) float64: where (v, 3) vertices lie along each axis if that is far from 0 for their
    size, else 0: float32 would round them coarsely there."""
    if not len(vertices) or not np.isfinite(vertices).all():
        return np.zeros(3)
    lo, hi = vertices.min(axis=0), vertices.max(axis=0)
    centre = (lo + hi) / 2
    return np.where(np.abs(centre) > (hi - lo).max(), centre, 0.0)


def _begins(group: np.ndarray, t: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """(m,) bool: whether a hit is of another group than the one before, or its t, off by
    ``reach`` at most, past all that that one's may be."""
    new = np.ones(len(t), bool)
    new[1:] = (np.diff(group) > 0) | (t[1:] - reach[1:] > t[:-1] + reach[:-1])
    return new


def _places(blurred: np.ndarray, t: np.ndarray, sharp: np.ndarray) -> np.ndarray:
    """(k,) rows of the hits that begin a place, ray by ray and nearest first.

    Parameters
    ----------
    blurred : (m,) int, ascending: what float32 takes for one place
    t : (m,) float64, where a hit's ray meets the triangle's plane
    sharp : (m,) float64, how far float64's t is off; inf where it knows the ray to pass by: such
        a hit counts only where float64 knows of none at what float32 takes for its place
    """
    order = np.lexsort((t, ~np.isfinite(sharp), blurred))
    group, t, sharp = blurred[order], t[order], sharp[order]
    known = np.isfinite(sharp)
    first = np.r_[True, np.diff(group) > 0][:len(group)]
    stands = known == known[np.flatnonzero(first)[np.cumsum(first) - 1]]
    places = np.cumsum(first | known & _begins(group, t, np.where(known, sharp, 0)))
    # Of each place the row that comes first as hits are given, places in the order of t.
    rows = np.full(places[-1] if len(places) else 0, len(order))
    np.minimum.at(rows, places[stands] - 1, order[stands])
    return rows


def _check_status(status: np.ndarray) -> None:
    """Raise where rays were stopped: there may be more hits, or nearer ones."""
    stopped = int((status > 1).sum())
    if stopped:
        raise Error(f"{stopped} rays were stopped before their end was known; raise step_cap or "
                    "stack_size")


__all__ = ("RayMeshIntersector",)
