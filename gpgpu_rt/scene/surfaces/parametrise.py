"""Parametrise: a disc or a closed surface of genus 0 as a geometry image (Gu et al. 2002).

A closed surface is cut open along paths over its edges. The boundary goes around the square, each
stretch of it over a whole number of texels, so that both sides of a cut get the very same samples:
the image closes without a seam. The inside is embedded and sampled at the texels; where it comes
out too small, more paths are cut to there.
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

CUTS = 8              # paths at most that open a surface further
FAR = 0.02            # of the extent: an image that is further away from the surface is warned of
STRETCHED = 12.0      # times smaller than the median: worth a cut
TOLERANCE, ROUGH = 1e-5, 1e-3    # of conjugate gradients, for the image and for choosing cuts


@dataclass(frozen=True)
class Parametrisation:
    """A surface spread over a square.

    mesh : the surface, cut open
    flat : (v, 2) float64, where each of its vertices lies, row and column in cells
    image : (size + 1, size + 1, 3) float64, the surface at every texel
    """

    mesh: SurfaceMesh
    flat: np.ndarray
    image: np.ndarray

    def distances(self) -> np.ndarray:
        """(v,) float64: how far each vertex is from the image's triangles where it lies in the
        image, world units. The nearest triangle may be nearer: the largest distance bounds how
        far any vertex is from the surface of the image."""
        cell = np.clip(np.floor(self.flat), 0, len(self.image) - 2).astype(np.int64)
        down, right = (self.flat - cell).T[:, :, None]
        row, column = cell.T
        a, b = self.image[row, column], self.image[row, column + 1]
        c, d = self.image[row + 1, column + 1], self.image[row + 1, column]
        at = a + np.where(right >= down, right * (b - a) + down * (c - b),
                          down * (d - a) + right * (c - d))
        return np.linalg.norm(at - self.mesh.vertices, axis=1)

    def largest_distance(self) -> float:
        """The largest of the ``distances``, as a share of the surface's extent; warns where it is
        so large that parts of the surface are missing or torn."""
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
    """A geometry image of (size + 1, size + 1) texels of a connected surface.

    Parameters
    ----------
    scene, size, cuts : as for `parametrise`, which also says what is raised
    """
    found = parametrise(scene, size, cuts)
    found.largest_distance()
    return GeometryImage([found.image])


def parametrise(scene: Scene | trimesh.Trimesh | str | os.PathLike[str], size: int = 128,
                cuts: int = CUTS) -> Parametrisation:
    """A connected surface spread over a square.

    Parameters
    ----------
    scene : what `load_scene` takes; equal corners count as one vertex. Of holes all are closed but
        the one with the longest edge
    size : cells a side
    cuts : paths at most to places that come out too small

    Raises
    ------
    SceneError
        a surface that is not connected, not oriented alike, or has handles
    OptionError
        a size below 4 or cuts below 0
    """
    if size < 4 or cuts < 0:
        raise OptionError(f"remesh: size {size} and cuts {cuts}; give a size of 4 or more and "
                          "cuts of 0 or more")
    scene = load_scene(scene)
    mesh = SurfaceMesh.of_triangles(scene.triangles, scene.name)
    if not len(mesh.faces):
        raise SceneError(f"{scene.name}: has no triangle with area to make an image of")
    loops = mesh.loops()
    mesh = mesh.filled(loops[1:])
    parts, handles = mesh.parts(), mesh.euler() != (1 if loops else 2)
    if parts != 1 or handles:
        what = f"{parts} parts" if parts != 1 else "handles"
        raise SceneError(
            f"{scene.name}: has {what}; only one surface without handles can "
            "be made a geometry image")
    return _opened(mesh, size, cuts)


def _opened(mesh: SurfaceMesh, size: int, cuts: int) -> Parametrisation:
    """Spread, after paths were cut from the boundary to where it is worst; a closed surface is
    cut first from a far vertex to the one furthest from it."""
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
        # The face that comes out smallest, of those that a path can still be led to.
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
    """Where half-edges in a row start, (k,) in samples from the first one on; and the (samples, 3)
    positions at equal distances along them, without the end."""
    length = np.concatenate([[0], np.cumsum(mesh.lengths[edges])])
    places = mesh.vertices[np.append(mesh.start[edges], mesh.end[edges[-1]])]
    wanted = np.arange(samples) / samples * length[-1]
    ring = np.stack([np.interp(wanted, length, places[:, axis]) for axis in range(3)], axis=1)
    return length[:-1] / length[-1] * samples, ring


def _around(mesh: SurfaceMesh, opened: SurfaceMesh, was: np.ndarray, along: np.ndarray,
            size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The boundary of a surface that was cut open, as a loop of half-edges; where each starts, in
    texels around the image; and the (4 size, 3) positions around it, the same on both sides of
    each path between ends and forks of the cut."""
    loop = opened.loops()[0]
    if len(loop) < 4:
        raise SceneError(f"{mesh.name}: its boundary has {len(loop)} edges; four or more go "
                         "around an image")
    cut = np.bincount(mesh.start[along], minlength=len(mesh.vertices))[was[opened.start[loop]]]
    own = mesh.twin[loop] < 0     # the surface's own boundary
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
        if mate[k] < k:     # the other side's samples, the other way round
            ring = np.concatenate([opened.vertices[opened.start[path[:1]]], rings[mate[k]][:0:-1]])
        at.append(place + samples[:k].sum())
        rings.append(ring)
    return loop, np.concatenate(at), np.concatenate(rings)


def _sharpest(mesh: SurfaceMesh, loop: np.ndarray) -> int:
    """Where along a loop it turns most."""
    ahead = mesh.vertices[mesh.end[loop]] - mesh.vertices[mesh.start[loop]]
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-300)
    return int(np.argmin((ahead * np.roll(ahead, 1, axis=0)).sum(axis=1)))


def _shares(length: np.ndarray, mate: np.ndarray, total: int) -> np.ndarray:
    """Whole numbers, 1 or more, about in proportion to lengths, alike for mates (a path may be its
    own), that add up to ``total``, an even number."""
    spare = total - 2 * len(length)
    if spare < 0:
        raise OptionError(f"remesh: {len(length)} stretches of boundary do not fit around an "
                          f"image of {total // 4} cells a side; give a larger size or fewer cuts")
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
    """(k, 2) row and column of places around an image of this many cells a side, from its first
    texel along the first row on."""
    side, along = np.divmod(at, size)
    ends = np.full_like(at, size)
    rows = np.choose(side.astype(int) % 4, [0 * at, along, ends, ends - along])
    columns = np.choose(side.astype(int) % 4, [along, ends, ends - along, 0 * at])
    return np.stack([rows, columns], axis=1)


def _flattened(mesh: SurfaceMesh, loop: np.ndarray, at: np.ndarray, size: int,
               guess: np.ndarray | None, tolerance: float) -> np.ndarray:
    """(v, 2) row and column of each vertex, the loop's half-edges starting at these places around
    the image."""
    at = at.copy()
    for corner in range(1, 4):    # the nearest vertex goes to the corner, else it is cut off
        at[np.argmin(np.abs(at - corner * size))] = corner * size
    return embed(mesh, mesh.start[loop], _square(at, size), size, guess, tolerance)


def _stretch(mesh: SurfaceMesh, flat: np.ndarray, size: int) -> np.ndarray:
    """(f,) how many times smaller than it is each triangle comes out."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    p, q, r = flat[mesh.faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return area / np.maximum(np.abs(cross(q - p, r - p)), 1e-12 * size**2)
