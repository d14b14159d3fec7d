"""Embedding: an open surface laid flat, its boundary given, no triangle turned over.

Each inner vertex lies at the mean of its neighbours, by positive weights: an embedding for any of
them, where the boundary is convex (W. Tutte, "How to draw a graph", 1963). Those of mean value
coordinates (M. Floater, 2003) keep shapes well; made symmetric, they suit conjugate gradients.
"""
from __future__ import annotations

import numpy as np

from ...accel.morton import morton_order
from .surface_mesh import SurfaceMesh

PATCHES = 500    # of vertices, at most, in the coarse half of the preconditioner


def embed(mesh: SurfaceMesh, border: np.ndarray, places: np.ndarray, size: int,
          guess: np.ndarray | None = None, tolerance: float = 1e-5) -> np.ndarray:
    """(v, 2): each inner vertex at the mean of its neighbours, by positive weights.

    Parameters
    ----------
    border : (b,) vertices of the boundary; places : (b, 2) where they are
    guess : (f, 2) where the faces may be about, to start from
    tolerance : how much less the means are missed in the end than with all in the middle
    """
    corners = mesh.vertices[mesh.faces]
    one = np.roll(corners, -1, axis=1) - corners      # along each corner's own half-edge
    two = np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(one, two), axis=2)
    half = np.clip(np.arctan2(sine, (one * two).sum(axis=2)) / 2, 1e-3, np.pi / 2 - 1e-3)
    length = np.maximum(mesh.lengths.reshape(-1, 3), 1e-9 * mesh.size)
    # Of the mean value weights of an edge from both its ends, the halves that lie in this face.
    weight = ((np.tan(half) + np.tan(np.roll(half, -1, axis=1))) / length).reshape(-1)
    count = len(mesh.vertices)
    pairs, pair = np.unique(np.concatenate([mesh.start * count + mesh.end,
                                            mesh.end * count + mesh.start]), return_inverse=True)
    pull = np.bincount(pair.reshape(-1), np.concatenate([weight, weight]))
    here, there = np.divmod(pairs, count)
    first = np.searchsorted(here, np.arange(count))
    total = np.add.reduceat(pull, first)
    free = np.ones(count)
    free[border] = 0

    def missed(at: np.ndarray) -> np.ndarray:
        """Weights times (own place less neighbours'), where a vertex is free; row + i column."""
        return (total * at - np.add.reduceat(pull * at[there], first)) * free

    at = np.full(count, (0.5 + 0.5j) * size)
    at[border] = places[:, 0] + 1j * places[:, 1]
    left = -missed(at)
    goal = tolerance * np.linalg.norm(left)
    if guess is not None:
        near = np.bincount(mesh.start, minlength=count)
        row, column = (np.bincount(mesh.start, np.repeat(g, 3), count) / near for g in guess.T)
        at = np.where(free > 0, row + 1j * column, at)
        left = -missed(at)
    # Errors that reach far are mended between patches of vertices, the others one by one.
    patches = min(count // 16 + 1, PATCHES)
    patch = np.empty(count, np.int64)
    patch[morton_order(mesh.vertices if guess is None else
                       np.stack([at.real, at.imag, 0 * at.real], axis=1))] = (
        np.arange(count) * patches // count)
    coarse = np.bincount(patch[here] * patches + patch[there], -pull * free[here] * free[there],
                         patches**2).reshape(patches, patches)
    coarse[np.diag_indices(patches)] += np.bincount(patch, total * free, patches)
    coarse[np.diag_indices(patches)] += 1e-9 * coarse.diagonal().max()    # a patch of the border
    inverse = np.linalg.inv(coarse)

    def mended(left: np.ndarray) -> np.ndarray:
        parts = [np.bincount(patch, part, patches) for part in (left.real, left.imag)]
        return left / total + ((parts[0] + 1j * parts[1]) @ inverse)[patch] * free

    scaled = mended(left)
    way, power = scaled, np.vdot(left, scaled).real
    for _ in range(20 * int(np.sqrt(count)) + 100):
        if np.linalg.norm(left) <= goal:
            break
        bent = missed(way)
        step = power / np.vdot(way, bent).real
        at = at + step * way
        left = left - step * bent
        scaled = mended(left)
        before, power = power, np.vdot(left, scaled).real
        way = scaled + power / before * way
    return np.stack([at.real, at.imag], axis=1)
