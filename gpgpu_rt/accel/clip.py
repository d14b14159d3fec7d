"""Clip: bounds the part of a triangle that lies inside a box.

The method is "split clipping" (V. Havran, J. Bittner, "On improving kd-trees for ray shooting",
WSCG 2002), which Wald and Havran (2006) call "perfect splits". Havran and Bittner cut the triangle
by the planes of the box one after another. Here all corners of the final polygon are computed
directly. They are the ends of the triangle's edges after clipping to the box, and the points where
an edge of the box pierces the triangle.
"""
from __future__ import annotations

import numpy as np

CHUNK = 1 << 13     # triangles per block, so that the temporary arrays fit in the cache
EDGE_EPSILON = 1e-300   # replaces 0 in the direction of an edge before the division


def clip_bounds(vertices: np.ndarray, index: np.ndarray, lo: np.ndarray,
                hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of the part of triangle `index[i]` inside box i.

    Parameters
    ----------
    vertices : (3, 3, n) float32, indexed by vertex, axis and triangle
    index : (m,) int, indices of triangles
    lo, hi : (3, m) float32, corners of the boxes

    Returns
    -------
    lo, hi : (3, m) float32; lo > hi where the triangle is outside the box. The errors of the
        bounds are a few float32 spacings, less than the callers' padding
    """
    out_lo = np.empty_like(lo)
    out_hi = np.empty_like(hi)
    for begin in range(0, len(index), CHUNK):
        part = slice(begin, begin + CHUNK)
        triangle = vertices.take(index[part], axis=2).astype(np.float64)
        with np.errstate(all="ignore"):
            bounds = _clip(triangle, lo[:, part].astype(np.float64),
                           hi[:, part].astype(np.float64))
        out_lo[:, part], out_hi[:, part] = bounds
    return out_lo, out_hi


def _clip(v: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    edges = np.stack([v[1] - v[0], v[2] - v[1], v[0] - v[2]])
    out_lo = np.full_like(lo, np.inf)
    out_hi = np.full_like(hi, -np.inf)
    for i in range(3):
        _add_edge(v[i], edges[i], lo, hi, out_lo, out_hi)
    # touched[lower or upper, axis, box]: whether an edge of this box face pierces the triangle.
    touched = np.zeros((2, *lo.shape), bool)
    for axis in range(3):
        _add_box_edges(v, edges, axis, lo, hi, out_lo, out_hi, touched)
    for box, faces in zip((lo, hi), touched):
        face = np.where(faces, box, np.nan)
        np.fmin(out_lo, face, out=out_lo)
        np.fmax(out_hi, face, out=out_hi)
    return out_lo, out_hi


def _add_edge(start: np.ndarray, edge: np.ndarray, lo: np.ndarray, hi: np.ndarray,
              out_lo: np.ndarray, out_hi: np.ndarray) -> None:
    """Extend the bounds by the part of a triangle's edge inside the box (slab test)."""
    inverse = 1 / np.where(edge == 0, EDGE_EPSILON, edge)
    t_lo, t_hi = (lo - start) * inverse, (hi - start) * inverse
    enter = np.maximum(np.minimum(t_lo, t_hi).max(axis=0), 0)
    leave = np.minimum(np.maximum(t_lo, t_hi).min(axis=0), 1)
    outside = enter > leave
    for t in (enter, leave):
        at = np.where(outside, np.nan, t)
        point = np.minimum(np.maximum(start + at * edge, lo), hi)
        np.fmin(out_lo, point, out=out_lo)
        np.fmax(out_hi, point, out=out_hi)


def _add_box_edges(v: np.ndarray, edges: np.ndarray, a: int, lo: np.ndarray, hi: np.ndarray,
                   out_lo: np.ndarray, out_hi: np.ndarray, touched: np.ndarray) -> None:
    """Extend the bounds along axis `a` by the points where the box's four edges along `a` pierce
    the triangle. Mark in ``touched`` the faces of the other two axes that contain these points."""
    b, c = (a + 1) % 3, (a + 2) % 3
    normal_a = edges[0, b] * edges[1, c] - edges[0, c] * edges[1, b]
    slope_b = (edges[0, c] * edges[1, a] - edges[0, a] * edges[1, c]) / normal_a
    slope_c = (edges[0, a] * edges[1, b] - edges[0, b] * edges[1, a]) / normal_a
    side_b = [edges[:, c] * (box[b] - v[:, b]) for box in (lo, hi)]
    side_c = [edges[:, b] * (box[c] - v[:, c]) for box in (lo, hi)]
    rise_b = [v[0, a] - slope_b * (box[b] - v[0, b]) for box in (lo, hi)]
    rise_c = [slope_c * (box[c] - v[0, c]) for box in (lo, hi)]
    for j in range(2):
        for k in range(2):
            x = rise_b[j] - rise_c[k]
            # The box's edge pierces the triangle if all three edges of the triangle pass the box's
            # edge on the same side.
            pierced = (side_c[k] >= side_b[j]).all(axis=0) | (side_c[k] <= side_b[j]).all(axis=0)
            pierced &= (x >= lo[a]) & (x <= hi[a])      # false if normal_a is 0: x is not finite
            x = np.where(pierced, x, np.nan)
            np.fmin(out_lo[a], x, out=out_lo[a])
            np.fmax(out_hi[a], x, out=out_hi[a])
            touched[j, b] |= pierced
            touched[k, c] |= pierced
