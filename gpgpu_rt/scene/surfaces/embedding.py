"""Embedding: flattens an open surface with a given boundary, without flipping any triangle.

Each inner vertex lies at a weighted mean of its neighbours. With a convex boundary, any positive
weights give an embedding (W. Tutte, "How to draw a graph", 1963). The weights of mean value
coordinates (M. Floater, 2003) preserve shapes well. This module makes the weights symmetric, which
conjugate gradients require.
"""
from __future__ import annotations

import numpy as np

from ...accel.morton import morton_order
from .surface_mesh import SurfaceMesh

PATCHES = 500    # largest number of patches of vertices in the preconditioner's coarse level


def embed(mesh: SurfaceMesh, border: np.ndarray, places: np.ndarray, size: int,
          guess: np.ndarray | None = None, tolerance: float = 1e-5) -> np.ndarray:
    """Return the flat position of each vertex, (v, 2), row and column.

    Parameters
    ----------
    mesh : the open surface
    border : (b,) vertices of the boundary
    places : (b, 2) the fixed positions of the vertices ``border``
    size : cells along a side of the square that the flat surface fills
    guess : (f, 2) approximate positions of the faces, from which the solver starts; None to start
        at the centre
    tolerance : the solver stops when the residual is this share of the residual with all inner
        vertices at the centre
    """
    corners = mesh.vertices[mesh.faces]
    one = np.roll(corners, -1, axis=1) - corners      # along the half-edge that starts at a corner
    two = np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(one, two), axis=2)
    half = np.clip(np.arctan2(sine, (one * two).sum(axis=2)) / 2, 1e-3, np.pi / 2 - 1e-3)
    length = np.maximum(mesh.lengths.reshape(-1, 3), 1e-9 * mesh.size)
    # Each face at an edge adds the tangents at both ends, so the edge's weight is symmetric.
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
        """Return the residual of each free vertex: the weighted sum of the differences between the
        vertex and its neighbours. Positions are complex: row + i column."""
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
    # The preconditioner has two levels. A coarse matrix over patches of vertices reduces errors
    # that extend over many vertices; the diagonal of the full matrix reduces local errors.
    patches = min(count // 16 + 1, PATCHES)
    patch = np.empty(count, np.int64)
    patch[morton_order(mesh.vertices if guess is None else
                       np.stack([at.real, at.imag, 0 * at.real], axis=1))] = (
        np.arange(count) * patches // count)
    coarse = np.bincount(patch[here] * patches + patch[there], -pull * free[here] * free[there],
                         patches**2).reshape(patches, patches)
    coarse[np.diag_indices(patches)] += np.bincount(patch, total * free, patches)
    # Make the matrix regular: a patch with only border vertices has a row of zeros.
    coarse[np.diag_indices(patches)] += 1e-9 * coarse.diagonal().max()
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
