"""Tables: fills the node tables of the BVH family.

When boxes change, only the boxes of a table are written again. ``Threads`` has nodes with escape
indices, once or once per direction octant. ``Pairs`` has inner nodes with their children's boxes.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from ...accel.quantise import quantise
from ...gl.lazy_field import Column
from ...gl.packed_record import PackedRecord
from ...gl.record import Record
from .octant_copies import OctantCopies
from .records import (
    BVH_NODE, BVH_PAIR, QUANTISED_NODE_8, QUANTISED_NODE_16, QUANTISED_PAIR_8, QUANTISED_PAIR_16
)
from .tree import Bvh

Options = Mapping[str, Any]
Fields = dict[str, np.ndarray | Column]


class Layout(Protocol):
    """The arrangement of a tree's nodes in a table. It stays valid when the boxes change."""

    uniforms: dict[str, Any]
    stack_levels: int

    def __init__(self, bvh: Bvh, options: Options) -> None: ...

    @staticmethod
    def record(options: Options) -> Record | PackedRecord: ...

    def fields(self, bvh: Bvh, options: Options) -> tuple[Fields, dict[str, Any]]:
        """Return the table's fields, and the uniforms that depend on boxes.

        ``bvh`` is the tree of the constructor, perhaps with other boxes.
        """

    def boxes(self, bvh: Bvh) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corners of the nodes in the table, (n, 3) float32 each."""


class Threads:
    """A table with a BVH_NODE or QUANTISED_NODE record for each node of the tree or its copies."""

    def __init__(self, bvh: Bvh, options: Options) -> None:
        nodes, self.stack_levels = len(bvh.escape), 0
        # `source` has the node of each record. `reversed`, (records, 3) bool, marks the axes on
        # which the octant's directions are negative: `lo` and `hi` are exchanged there.
        self.source, self.reversed = np.arange(nodes, dtype=np.int32), None
        self.links = _links(bvh.escape, bvh.first, bvh.count, 0)
        if options["octants"]:
            copies = OctantCopies.of(bvh, shared_subtrees=options["shared_subtrees"] or 0)
            nodes, shared = copies.source.shape[1], copies.shared
            links = [_links(copies.escape[octant], copies.first[octant], copies.count[octant],
                            octant * nodes) for octant in range(8)]
            for part, below in zip(links, copies.below):
                part["first"] = np.where(below < 0, part["first"], _portal_code(8 * nodes + below))
            links.append(_links(copies.shared_escape, bvh.first[shared], bvh.count[shared],
                                8 * nodes))
            self.links = {name: np.concatenate([part[name] for part in links])
                          for name in self.links}
            self.source = np.append(copies.source, shared)
            if not options["shared_subtrees"]:
                negative = np.arange(8)[:, None] >> np.arange(3) & 1 == 1
                self.reversed = np.repeat(negative, nodes, axis=0)
        self.uniforms = {"node_count": nodes}

    @staticmethod
    def record(options: Options) -> Record | PackedRecord:
        return {None: BVH_NODE, 16: QUANTISED_NODE_16,
                8: QUANTISED_NODE_8}[options["quantise_nodes"]]

    def fields(self, bvh: Bvh, options: Options) -> tuple[Fields, dict[str, Any]]:
        if not options["quantise_nodes"]:
            return {**self.links, "lo": self._corner(bvh.lo, bvh.hi),
                    "hi": self._corner(bvh.hi, bvh.lo)}, {}
        # Exchange the corners only after quantising, which rounds lower bounds down and upper
        # bounds up.
        quantum, (lo, hi) = quantise(bvh.lo, bvh.hi, *scene_box(bvh), options["quantise_nodes"])
        first, escape = self.links["first"], self.links["escape"]
        leaf, portal = first >= 0, first < -1
        return {"leaf": leaf, "last": escape < 0, "portal": portal,
                "target": np.where(leaf, first, np.where(portal, _portal_code(first),
                                                         np.maximum(escape, 0))),
                **_by_axis("lo", self._corner(lo, hi)), **_by_axis("hi", self._corner(hi, lo))
                }, {"quantum": tuple(quantum)}

    def boxes(self, bvh: Bvh) -> tuple[np.ndarray, np.ndarray]:
        return bvh.lo[self.source], bvh.hi[self.source]

    def _corner(self, met: np.ndarray, other: np.ndarray) -> Column:
        """Return a corner of each record's box: ``met``, but ``other`` along reversed axes."""
        def make(rows: slice) -> np.ndarray:
            source = self.source[rows]     # `take` is several times as fast as indexing
            found = met.take(source, axis=0)
            if self.reversed is not None:
                np.copyto(found, other.take(source, axis=0), where=self.reversed[rows])
            return found
        return Column(len(self.source), make)


class Pairs:
    """A table with a BVH_PAIR or QUANTISED_PAIR record for each inner node."""

    def __init__(self, bvh: Bvh, options: Options) -> None:
        left, right = bvh.children()
        inner = left >= 0
        link = np.where(inner, np.cumsum(inner) - 1, -1 - bvh.first)
        self.source = np.flatnonzero(inner)
        self.children = {"left": left[inner], "right": right[inner]}
        self.links = {side: link[child] for side, child in self.children.items()}
        self.uniforms = {"node_count": len(link), "root": int(link[0]) if len(link) else 0}
        self.stack_levels = max(1, bvh.depth)

    @staticmethod
    def record(options: Options) -> Record | PackedRecord:
        return {None: BVH_PAIR, 16: QUANTISED_PAIR_16,
                8: QUANTISED_PAIR_8}[options["quantise_nodes"]]

    def fields(self, bvh: Bvh, options: Options) -> tuple[Fields, dict[str, Any]]:
        if not options["quantise_nodes"]:
            return {**self.links, **{f"{side}_{end}": _gathered(corner, child)
                                     for side, child in self.children.items()
                                     for end, corner in (("lo", bvh.lo), ("hi", bvh.hi))}}, {}
        quantum, (lo, hi) = quantise(bvh.lo, bvh.hi, *scene_box(bvh), options["quantise_nodes"])
        fields: Fields = {}
        for side, child in self.children.items():
            link = self.links[side]
            fields |= {side: np.where(link < 0, -1 - link, link), f"{side}_leaf": link < 0,
                       **_by_axis(f"{side}_lo", _gathered(lo, child)),
                       **_by_axis(f"{side}_hi", _gathered(hi, child))}
        return fields, {"quantum": tuple(quantum)}

    def boxes(self, bvh: Bvh) -> tuple[np.ndarray, np.ndarray]:
        return bvh.lo[self.source], bvh.hi[self.source]


def scene_box(bvh: Bvh) -> tuple[np.ndarray, np.ndarray]:
    """Return the scene's lower and upper corner, (3,) float32 each, world units."""
    return (bvh.lo[0], bvh.hi[0]) if len(bvh.lo) else (np.zeros(3, np.float32),) * 2


def _portal_code(nodes: np.ndarray) -> np.ndarray:
    """Convert a portal's first shared node to the field ``first`` of BVH_NODE, or back."""
    return -2 - nodes


def _links(escape: np.ndarray, first: np.ndarray, count: np.ndarray,
           base: int) -> dict[str, np.ndarray]:
    """Return the fields ``escape`` and ``first`` of a tree whose nodes begin at row ``base``."""
    return {"escape": np.where(escape < len(escape), escape + base, -1),
            "first": np.where(count > 0, first, -1)}


def _gathered(values: np.ndarray, index: np.ndarray) -> Column:
    return Column(len(index), lambda rows: values.take(index[rows], axis=0))


def _by_axis(prefix: str, corner: Column) -> Fields:
    def component(axis: int) -> Callable[[slice], np.ndarray]:
        return lambda rows: corner[rows][:, axis]
    return {f"{prefix}_{letter}": Column(len(corner), component(axis))
            for axis, letter in enumerate("xyz")}
