"""Hybrid build of a kd-tree: Morton codes give the upper levels, and SAH splits the levels below.

C. Lauterbach et al., "Fast BVH construction on GPUs", Eurographics 2009, build a BVH in this way;
Hachisuka's survey proposes it for kd-trees (section 5). In the upper levels, SAH is slow, because
each node has many references.

In the paper, each triangle has a code. Here, every cell of a coarse lattice has a code, and a list
of the triangles that overlap the cell. A node of the upper levels has a prefix of bits, and
contains the cells whose codes begin with this prefix. Nodes are halved along x, y and z in turn. A
node is an empty leaf if no triangle overlaps its cells.
"""
from __future__ import annotations

import numpy as np

from ...accel.bounds import padding, scene_box
from ...accel.clip import clip_bounds
from ...accel.morton import morton_3d
from ...accel.options import choose, in_range, refuse_unknown
from ...accel.runs import expand, owners
from ..grid.cells import build_grid
from .sah import Costs, KdLevel
from .sah_growth import Rules, grow, root_level, sah_costs
from .tree import LEAF, LooseKdTree, depth_cap, join

MORTON_BITS = 2     # bits per axis: 64 cells, six levels
MOST_BITS = 7       # bits per axis: 2 million cells


def build(triangles: np.ndarray, *, morton_bits: int = MORTON_BITS, split: str = "binned",
          bins: int = 32, traversal_cost: float = Costs.traversal,
          intersection_cost: float = Costs.intersection,
          empty_bonus: float = Costs.empty_bonus, max_depth: int | None = None,
          **unknown: object) -> LooseKdTree:
    """Build the upper levels by codes, and the levels below by the surface area heuristic.

    Parameters
    ----------
    morton_bits : bits of a code per axis; larger values act as a third of `max_depth`
    split, bins, traversal_cost, intersection_cost, empty_bonus, max_depth : as in
        `sah_build.build`
    """
    refuse_unknown(build, unknown)
    rules = Rules(sah_costs(traversal_cost, intersection_cost, empty_bonus),
                  choose("split", split, ("binned", "exact")),
                  in_range("bins", bins, 2, 1024, int), depth_cap(triangles, max_depth),
                  padding(triangles))
    bits = min(in_range("morton_bits", morton_bits, 1, MOST_BITS, int), rules.max_depth // 3)
    vertices = np.ascontiguousarray(triangles.transpose(1, 2, 0))
    if not (bits and len(triangles)):
        return grow(root_level(triangles, rules.pad), 0, vertices, rules)[0].loose()
    planes = lattice(triangles, bits)
    level, codes = cells_in_order(triangles, vertices, planes, bits, rules.pad)
    top = upper_levels(codes, bits, planes)
    below = grow(level, 3 * bits, vertices, rules)[0].loose()
    return join(top, [np.arange(len(codes))], [below])


def lattice(triangles: np.ndarray, bits: int) -> np.ndarray:
    """Return the coordinates of the lattice's planes across each axis, (2^bits + 1, 3) float32.

    The outermost planes are the faces of the scene's box.
    """
    lo, hi = scene_box(triangles)
    step = (hi.astype(np.float64) - lo) / (1 << bits)
    planes = (lo + step * np.arange((1 << bits) + 1)[:, None]).astype(np.float32)
    planes[0], planes[-1] = lo, hi
    return planes


def cells_in_order(triangles: np.ndarray, vertices: np.ndarray, planes: np.ndarray, bits: int,
                   pad: np.float32) -> tuple[KdLevel, np.ndarray]:
    """Return a level whose nodes are the occupied cells, sorted by code, and the sorted codes.

    planes : see `lattice`
    """
    grid = build_grid(triangles, resolution=1 << bits)
    count = np.diff(grid.cell_start)
    cell = np.flatnonzero(count)
    coordinates = cell[:, None] >> bits * np.arange(3) & (1 << bits) - 1
    codes = morton_3d(*coordinates.T)
    order = np.argsort(codes)
    cell, coordinates, codes = cell[order], coordinates[order], codes[order]
    along = np.arange(3)
    lo, hi = planes[coordinates, along].T, planes[coordinates + 1, along].T
    owner = owners(count[cell])
    triangle = grid.references[expand(grid.cell_start[cell], count[cell])]
    part_lo, part_hi = clip_bounds(vertices, triangle, lo[:, owner] - pad, hi[:, owner] + pad)
    whole = part_lo[0] <= part_hi[0]
    owner, triangle = owner[whole], triangle[whole]
    box = np.concatenate([np.maximum(part_lo[:, whole] - pad, lo[:, owner]),
                          np.minimum(part_hi[:, whole] + pad, hi[:, owner])])
    held = np.bincount(owner, minlength=len(cell))
    kept = np.flatnonzero(held)     # drop cells in which no triangle has a part
    return (KdLevel(np.ascontiguousarray(lo[:, kept]), np.ascontiguousarray(hi[:, kept]),
                    held[kept], triangle, box), codes[kept])


def upper_levels(codes: np.ndarray, bits: int, planes: np.ndarray) -> LooseKdTree:
    """Return the tree of the upper levels. ``codes`` are the occupied cells' codes, ascending.

    The cells are not nodes of this tree. If the tree has n nodes, a child n + k is cell k.
    """
    prefixes = [np.unique(codes >> 3 * bits - depth) for depth in range(3 * bits + 1)]
    inner = sum(map(len, prefixes[:-1]))
    child, axis, plane, first = [], [], [], 0
    for depth, (prefix, deeper) in enumerate(zip(prefixes, prefixes[1:])):
        wanted = 2 * np.repeat(prefix, 2) + np.tile([0, 1], len(prefix))
        at = np.searchsorted(deeper, wanted)
        found = deeper[np.minimum(at, len(deeper) - 1)] == wanted
        first += len(prefix)
        child.append(np.where(found, first + at, -1))
        axis.append(np.full(len(prefix), depth % 3, np.int8))
        plane.append(planes[middle_of(prefix, depth, bits), depth % 3])
    children = np.concatenate(child)
    empty = np.flatnonzero(children < 0)
    # Number the inner nodes first, then the empty leaves, then the cells.
    children[children >= inner] += len(empty)
    children[empty] = inner + np.arange(len(empty))
    nothing = np.full(len(empty), -1, np.int64)
    zeros = np.zeros(inner + len(empty), np.int64)
    return LooseKdTree(
        np.concatenate([*axis, np.full(len(empty), LEAF, np.int8)]),
        np.concatenate([*plane, np.zeros(len(empty), np.float32)]),
        np.concatenate([children[0::2], nothing]), np.concatenate([children[1::2], nothing]),
        zeros, zeros, np.zeros(0, np.int32))


def middle_of(prefix: np.ndarray, depth: int, bits: int) -> np.ndarray:
    """Return the index of the lattice plane, across axis ``depth`` % 3, that halves each node at
    ``depth``."""
    coordinate = np.zeros_like(prefix)
    for bit in range(depth % 3, depth, 3):
        coordinate = coordinate << 1 | prefix >> depth - 1 - bit & 1
    return (2 * coordinate + 1) << bits - depth // 3 - 1
