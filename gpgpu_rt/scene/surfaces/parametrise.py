"""Parametrise: maps a disc or a closed surface of genus 0 to a geometry image (Gu et al. 2002).

A closed surface is cut open along paths of edges. The boundary is mapped to the border of the
square so that each path covers a whole number of texels. The two sides of a cut then have the same
samples, and the surface closes without a gap. The inner vertices are embedded in the square, and
the surface is sampled at the texels. A part that the embedding shrinks too much gets another cut.
"""
from __future__ import annotations

import os
import warnings
from dataclasses import dataclass

import numpy as np
import trimesh

from ...errors import OptionError, SceneError
from ..loading import load_scene
from ..scene import Scene
from .embedding import embed
from .geometry_image import GeometryImage
from .resampling import cross, rasterised
from .surface_mesh import SurfaceMesh

CUTS = 8              # largest number of additional cuts
# Warn if the image is further from the surface than this share of the surface's extent.
FAR = 0.02
# Make another cut, to the most shrunk face, if this face shrinks at least this many times as much
# as the median face.
STRETCHED = 12.0
# The solver's tolerances: for the final embedding, and for choosing cuts.
TOLERANCE, ROUGH = 1e-5, 1e-3


@dataclass(frozen=True)
class Parametrisation:
    """A surface flattened to a square.

    mesh : The surface after cutting.
    flat : Row and column of each vertex of the mesh in cells, (v, 2) float64.
    image : Position of the surface at every texel, (size + 1, size + 1, 3) float64.
    """

    mesh: SurfaceMesh
    flat: np.ndarray
    image: np.ndarray

    def distances(self) -> np.ndarray:
        """Return the distance of each vertex, (v,) float64, world units, from the image's point at
        the vertex's row and column. Other points of the image may be nearer."""
        cell = np.clip(np.floor(self.flat), 0, len(self.image) - 2).astype(np.int64)
        down, right = (self.flat - cell).T[:, :, None]
        row, column = cell.T
        a, b = self.image[row, column], self.image[row, column + 1]
        c, d = self.image[row + 1, column + 1], self.image[row + 1, column]
        at = a + np.where(right >= down, right * (b - a) + down * (c - b),
                          down * (d - a) + right * (c - d))
        return np.linalg.norm(at - self.mesh.vertices, axis=1)

    def largest_distance(self) -> float:
        """Return the largest distance as a share of the surface's extent. Warn if the share
        exceeds FAR: parts of the surface are then missing or torn."""
        places = self.mesh.vertices[self.mesh.faces].reshape(-1, 3)
        share = float(self.distances().max() / np.ptp(places, axis=0).max())
        if share > FAR:
            warnings.warn(
                f"{self.mesh.name}: the image is up to {share:.1%} of the extent away from the "
                "surface, so parts are cut off or torn; give a larger size, or more cuts",
                stacklevel=3)
        return share


def remesh(scene: Scene | trimesh.Trimesh | str | os.PathLike[str], size: int = 128,
           cuts: int = CUTS) -> GeometryImage:
    """Return a geometry image of (size + 1, size + 1) texels of a connected surface.

    Parameters
    ----------
    scene, size, cuts : as for `parametrise`, which raises the same errors
    """
    found = parametrise(scene, size, cuts)
    found.largest_distance()
    return GeometryImage([found.image])


def parametrise(scene: Scene | trimesh.Trimesh | str | os.PathLike[str], size: int = 128,
                cuts: int = CUTS) -> Parametrisation:
    """Return a connected surface flattened to a square.

    Parameters
    ----------
    scene : an argument of `load_scene`. Corners at the same position become one vertex. All holes
        are closed, except the hole with the longest boundary
    size : cells along a side of the image
    cuts : largest number of additional cuts towards parts that the embedding shrinks too much

    Raises
    ------
    SceneError
        the surface has no triangle with three different corners, is not connected, is not
        consistently oriented, or has handles
    OptionError
        the size is below 4, or cuts is below 0
    """
    if size < 4 or cuts < 0:
        raise OptionError(f"remesh: size {size} and cuts {cuts}; give a size of 4 or more and "
                          "cuts of 0 or more")
    scene = load_scene(scene)
    mesh = SurfaceMesh.of_triangles(scene.triangles, scene.name)
    if not len(mesh.faces):
        raise SceneError(f"{scene.name}: has no triangle with an area; give a surface")
    loops = mesh.loops()
    mesh = mesh.filled(loops[1:])
    parts, handles = mesh.parts(), mesh.euler() != (1 if loops else 2)
    if parts != 1 or handles:
        what = f"{parts} parts" if parts != 1 else "handles"
        raise SceneError(
            f"{scene.name}: has {what}; a geometry image needs a connected surface without "
            "handles")
    return _opened(mesh, size, cuts)


def _opened(mesh: SurfaceMesh, size: int, cuts: int) -> Parametrisation:
    """Return the flattened surface, after cutting from the boundary to the most shrunk faces.

    A closed surface is first cut along a path of edges. The path begins at the vertex furthest
    from the centre, and ends at the vertex that is furthest from there along edges.
    """
    along = np.zeros(len(mesh.start), bool)
    if (mesh.twin >= 0).all():
        middle = mesh.vertices.mean(axis=0)
        one = int(np.argmax(np.linalg.norm(mesh.vertices - middle, axis=1)))
        distance = mesh.distances(np.array([one]))
        along = mesh.edges_along(mesh.path(distance, int(np.argmax(distance))))
    guess = None
    for attempt in range(cuts + 1):
        opened, was = mesh.cut(along)
        loop, at, ring = _around(mesh, opened, was, along, size)
        flat = _flattened(opened, loop, at, size, guess, ROUGH)
        guess = flat[opened.faces].mean(axis=1)
        stretch = _stretch(opened, flat, size)
        distance = mesh.distances(np.unique(was[opened.start[loop]]))
        # Find the most shrunk face without a vertex on the boundary.
        score = np.where((distance[mesh.faces] > 0).all(axis=1), stretch, 0)
        worst = int(np.argmax(score))
        if attempt == cuts or score[worst] < STRETCHED * np.median(stretch):
            break
        along = along | mesh.edges_along(mesh.path(distance, int(mesh.faces[worst, 0])))
    flat = _flattened(opened, loop, at, size, guess, TOLERANCE)
    image = rasterised(flat, opened, size)
    edge = _square(np.arange(4.0 * size), size).astype(int)
    image[edge[:, 0], edge[:, 1]] = ring
    return Parametrisation(opened, flat, image)


def _along(mesh: SurfaceMesh, edges: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Sample k consecutive half-edges at equal distances. Return the start of each half-edge, (k,)
    in units of samples, and the samples' positions, (samples, 3), without the end point."""
    length = np.concatenate([[0], np.cumsum(mesh.lengths[edges])])
    places = mesh.vertices[np.append(mesh.start[edges], mesh.end[edges[-1]])]
    wanted = np.arange(samples) / samples * length[-1]
    ring = np.stack([np.interp(wanted, length, places[:, axis]) for axis in range(3)], axis=1)
    return length[:-1] / length[-1] * samples, ring


def _around(mesh: SurfaceMesh, opened: SurfaceMesh, was: np.ndarray, along: np.ndarray,
            size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Map the boundary of a cut surface to the border of the image.

    Return the loop of half-edges of the boundary; the start of each half-edge, in texels around
    the border; and the positions at the border's texels, (4 * size, 3). The loop is divided
    into paths at the ends and forks of cuts. The two paths along the two sides of a cut get texels
    with the same positions.
    """
    loop = opened.loops()[0]
    if len(loop) < 4:
        raise SceneError(f"{mesh.name}: its boundary has {len(loop)} edges; a geometry image "
                         "needs four or more")
    cut = np.bincount(mesh.start[along], minlength=len(mesh.vertices))[was[opened.start[loop]]]
    own = mesh.twin[loop] < 0     # true on the boundary of the uncut surface
    forks = np.flatnonzero((cut > 0) & (cut != 2) | (own != np.roll(own, 1)))
    if not len(forks):
        forks = np.array([_sharpest(mesh, loop)])
    loop = np.roll(loop, -forks[0])
    paths = np.split(loop, forks[1:] - forks[0])
    which = {int(path[0]): k for k, path in enumerate(paths)}
    mate = np.array([which[int(mesh.twin[path[-1]])] if mesh.twin[path[0]] >= 0 else k
                     for k, path in enumerate(paths)])
    samples = _shares(np.array([opened.lengths[path].sum() for path in paths]), mate, 4 * size)
    at, rings = [], []
    for k, path in enumerate(paths):
        place, ring = _along(opened, path, samples[k])
        if mate[k] < k:     # use the samples of the cut's other side in reverse
            ring = np.concatenate([opened.vertices[opened.start[path[:1]]], rings[mate[k]][:0:-1]])
        at.append(place + samples[:k].sum())
        rings.append(ring)
    return loop, np.concatenate(at), np.concatenate(rings)


def _sharpest(mesh: SurfaceMesh, loop: np.ndarray) -> int:
    """Return the index of the half-edge at whose start the loop turns most."""
    ahead = mesh.vertices[mesh.end[loop]] - mesh.vertices[mesh.start[loop]]
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-300)
    return int(np.argmin((ahead * np.roll(ahead, 1, axis=0)).sum(axis=1)))


def _shares(length: np.ndarray, mate: np.ndarray, total: int) -> np.ndarray:
    """Distribute ``total`` texels, an even number, to paths in proportion to their lengths, at
    least 1 each. The two sides of a cut are each other's ``mate`` and get the same number; any
    other path is its own mate."""
    spare = total - 2 * len(length)
    if spare < 0:
        raise OptionError(f"remesh: {len(length)} stretches of boundary do not fit around an "
                          f"image with sides of {total // 4} cells; give a larger size or fewer "
                          "cuts")
    share = 1 + np.floor(length / length.sum() * spare).astype(np.int64)
    share = np.minimum(share, share[mate])
    alone = np.flatnonzero(mate == np.arange(len(mate)))
    left = total - int(share.sum())
    if len(alone):
        share[alone[0]] += left
        return share
    pairs = np.flatnonzero(mate > np.arange(len(mate)))
    extra = np.zeros(len(mate), np.int64)
    extra[pairs] = left // 2 // len(pairs)
    extra[pairs[:left // 2 % len(pairs)]] += 1
    return share + extra + extra[mate]


def _square(at: np.ndarray, size: int) -> np.ndarray:
    """Return row and column, (k, 2), of positions ``at`` around the border of an image with
    ``size`` cells per side. Positions count from the first texel along the first row."""
    side, along = np.divmod(at, size)
    ends = np.full_like(at, size)
    rows = np.choose(side.astype(int) % 4, [0 * at, along, ends, ends - along])
    columns = np.choose(side.astype(int) % 4, [along, ends, ends - along, 0 * at])
    return np.stack([rows, columns], axis=1)


def _flattened(mesh: SurfaceMesh, loop: np.ndarray, at: np.ndarray, size: int,
               guess: np.ndarray | None, tolerance: float) -> np.ndarray:
    """Return (v, 2) row and column of each vertex. ``at`` has the positions around the image's
    border where the loop's half-edges start."""
    at = at.copy()
    for corner in range(1, 4):    # move the nearest vertex to each corner of the image
        at[np.argmin(np.abs(at - corner * size))] = corner * size
    return embed(mesh, mesh.start[loop], _square(at, size), size, guess, tolerance)


def _stretch(mesh: SurfaceMesh, flat: np.ndarray, size: int) -> np.ndarray:
    """Return (f,) the ratio of each triangle's area on the surface to its area in the image."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    p, q, r = flat[mesh.faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return area / np.maximum(np.abs(cross(q - p, r - p)), 1e-12 * size**2)
