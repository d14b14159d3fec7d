"""Quality of a built accelerator: cost by the surface area heuristic, depth, counts and bytes."""
from __future__ import annotations

from dataclasses import fields

import numpy as np

from ..accel.bounds import half_area
from .bih.tree import Bih
from .bvh.tree import Bvh
from .grid.cells import Grid
from .kdtree.tree import LEAF, KdTree

Structure = Grid | KdTree | Bvh | Bih


def sah_cost(structure: Structure, *, traversal_cost: float = 1.0,
             intersection_cost: float = 1.0) -> float:
    """Return the expected cost of a random line that crosses the scene's box and hits nothing.

    A node (or cell) costs `traversal_cost`, plus `intersection_cost` for each of its references.
    The sum weights each node by its surface area, relative to the scene's box.
    """
    return _cost(_areas(structure), traversal_cost, intersection_cost)


def _cost(areas: tuple[np.ndarray, np.ndarray, float], traversal: float,
          intersection: float) -> float:
    area, references, root = areas
    if root <= 0:
        return float(traversal)
    return float(np.sum(area * (traversal + intersection * references)) / root)


def quality(structure: Structure, *, traversal_cost: float = 1.0,
            intersection_cost: float = 1.0) -> dict[str, int | float]:
    """Return the figures of merit: name -> value.

    `references_per_leaf` ignores empty leaves (or cells); `references_per_triangle` ignores
    triangles without references.
    """
    areas, counts = _areas(structure), _leaf_counts(structure)
    filled = int(np.count_nonzero(counts))
    references = int(counts.sum())
    triangles = len(np.unique(_references(structure)))
    return {
        "sah_cost": _cost(areas, traversal_cost, intersection_cost),
        "depth": 0 if isinstance(structure, Grid) else structure.depth,
        "nodes": len(areas[0]),
        "leaves": len(counts),
        "empty_leaves": len(counts) - filled,
        "references": references,
        "references_per_leaf": references / max(filled, 1),
        "references_per_triangle": references / max(triangles, 1),
        "bytes": sum(value.nbytes for value in _arrays(structure)),
    }


def _arrays(structure: Structure) -> list[np.ndarray]:
    values = [getattr(structure, field.name) for field in fields(structure)]
    return [value for value in values if isinstance(value, np.ndarray)]


def _references(structure: Structure) -> np.ndarray:
    return structure.order if isinstance(structure, Bvh | Bih) else structure.references


def _leaf_counts(structure: Structure) -> np.ndarray:
    if isinstance(structure, Grid):
        return np.diff(structure.cell_start)
    if isinstance(structure, KdTree):
        return structure.count[structure.axis == LEAF]
    return structure.count[structure.count > 0]


def _areas(structure: Structure) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the half areas of nodes or cells, their numbers of references, and the root's half
    area."""
    if isinstance(structure, Grid):
        size = structure.cell_size.astype(np.float64)
        cells = np.diff(structure.cell_start)
        area = np.full(len(cells), half_area(np.zeros(3), size))
        root = half_area(structure.lo.astype(np.float64), structure.hi.astype(np.float64))
        return area, cells, float(root)
    lo, hi = (structure.lo, structure.hi) if isinstance(structure, Bvh) else structure.boxes()
    area = half_area(lo.astype(np.float64), hi.astype(np.float64), axis=1)
    return area, structure.count, float(area[0]) if len(area) else 0.0
