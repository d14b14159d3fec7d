"""Reinsertion: subtrees of a finished tree are taken out and put where they cost least.

D. Meister, J. Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", CGF
37(2), 2018. All nodes look for their best place at once; a subtree goes there as the sibling of
what is there, if nobody whose gain is greater is in the way. What an inner node costs is its area,
so the gain is in areas, and the SAH cost of the tree falls.

Departures: the search goes from ancestor to ancestor as the paper's does, but down from each by
levels and not depth first, as numpy takes many at once. Subtrees that others kept from moving look
again in the same round, where the paper has them wait for the next. Two that move exclude each
other where they change the same link, or where one would go into what the other moves; else their
paths may cross, and where all together gain nothing, the better half of them moves.
"""
from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ...accel import tree_order
from ...threads import threads
from .tree import LooseTree

AT_ONCE = 1 << 14   # nodes that look for their places together: they stay in a core's cache
WORTH = 0.03        # of the nodes that look again those that move, below which a round ends


def reinserted(tree: LooseTree, triangles: np.ndarray, rounds: int) -> LooseTree:
    """The same leaves in a tree that costs less.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    rounds : times that all nodes look for a place; the first two bring most of what there is
    """
    if not rounds or len(tree.left) < 5:     # below, no subtree has two places
        return tree
    tables = _Tables(tree, triangles)
    for _ in range(rounds):
        if not tables.round():
            break
    return LooseTree(tables.left.astype(np.int64), tables.right.astype(np.int64), tree.count,
                     tree.triangle)


@dataclass
class _Moves:
    """Subtrees and where they go.

    node : (m,) int32, roots of subtrees
    place : (m,) int32, their new siblings
    above : (m,) int32, the lowest node that both lie below
    gain : (m,) float32, how much area it saves
    """

    node: np.ndarray
    place: np.ndarray
    above: np.ndarray
    gain: np.ndarray

    def of(self, some: np.ndarray) -> _Moves:
        return _Moves(*(getattr(self, field.name)[some] for field in fields(self)))


class _Tables:
    """The tree while it changes; nodes keep their numbers.

    left, right, parent : (n,) int32, -1 where there is none
    box : (n, 6) float32, lower corners negated and upper ones, so that one maximum joins boxes; in
        units of the scene's largest side, from its middle
    area : (n,) float32, half of each box's surface
    """

    def __init__(self, tree: LooseTree, triangles: np.ndarray) -> None:
        self.left, self.right = tree.left.astype(np.int32), tree.right.astype(np.int32)
        lo, hi = (corner.astype(np.float64) for corner in tree.boxes(triangles))
        middle, side = (lo[0] + hi[0]) / 2, (hi[0] - lo[0]).max()
        scaled = np.concatenate([middle - lo, hi - middle], axis=1) / (side or 1)
        self.box = scaled.astype(np.float32)
        self.area = _half_area(self.box)
        self.parent = np.full(len(self.left), -1, np.int32)
        inner = np.flatnonzero(self.left >= 0)
        self.parent[self.left[inner]] = self.parent[self.right[inner]] = inner

    def round(self) -> int:
        """Let all nodes look for a place; how many moved."""
        waiting, moved = np.arange(len(self.left), dtype=np.int32), 0
        while len(waiting):
            moves = self._found(waiting[self.parent[waiting] > 0])
            made = self._without_conflict(moves)
            self._make(moves, made)
            waiting, moved = moves.node[~made], moved + made.sum()
            if made.sum() < WORTH * len(made):
                break
        return moved

    # The search --------------------------------------------------------------------------------

    def _found(self, nodes: np.ndarray) -> _Moves:
        """The best place of each subtree that gains by a move, the least gain first."""
        parts = np.split(nodes, range(AT_ONCE, len(nodes), AT_ONCE))
        found = list(threads(len(nodes))(self._search, parts))
        moves = _Moves(*(np.concatenate([getattr(part, field.name) for part in found])
                         for field in fields(_Moves)))
        return moves.of(np.argsort(moves.gain, kind="stable"))

    def _search(self, nodes: np.ndarray) -> _Moves:
        parent, area, box = self.parent, self.area, self.box
        moves = _Moves(nodes, np.full(len(nodes), -1, np.int32), parent[nodes],
                       np.zeros(len(nodes), np.float32))
        pivot = parent[nodes]           # an ancestor: below its other child places are looked for
        sibling = self._sibling(nodes)
        beside = box[sibling]           # what the pivot holds but for the subtree
        freed = area[pivot]             # by taking it out, up to the pivot
        on = np.arange(len(nodes))
        while len(on):
            self._search_below(moves, on, pivot, sibling[on], freed[on])
            on = on[pivot[on] > 0]
            # The parent goes as a whole; those above it shrink to what they still hold.
            high = on[pivot[on] != parent[nodes[on]]]
            beside[high] = np.maximum(beside[high], box[sibling[high]])
            freed[high] += area[pivot[high]] - _half_area(beside[high])
            # The pivot itself is a place: what joins the two has the box that it had.
            self._take(moves, high, pivot[high], pivot, freed[high] - area[pivot[high]])
            sibling[on] = self._sibling(pivot[on])
            pivot[on] = parent[pivot[on]]
        return moves.of(moves.place >= 0)

    def _search_below(self, moves: _Moves, which: np.ndarray, pivot: np.ndarray,
                      place: np.ndarray, left_over: np.ndarray) -> None:
        """Try these places and those below them.

        Parameters
        ----------
        which : (k,) int, of the moves, ascending; each may come several times
        pivot : (m,) int, of each move, the ancestor
        place : (k,) int
        left_over : (k,) float32, the area freed, without what nodes above the place grow by
        """
        while True:
            # Where a subtree goes, a box at least as large as its own becomes its parent's.
            hope = np.flatnonzero(left_over - self.area[moves.node[which]] > moves.gain[which])
            if not len(hope):
                return
            which, place = which[hope], place[hope]
            joined = _half_area(np.maximum(self.box[place], self.box[moves.node[which]]))
            gain = left_over[hope] - joined
            self._take(moves, which, place, pivot, gain)
            inner = np.flatnonzero(self.left[place] >= 0)
            which, place = which[inner], place[inner]
            left_over = np.repeat(gain[inner] + self.area[place], 2)
            which = np.repeat(which, 2)
            place = np.stack([self.left[place], self.right[place]], axis=1).reshape(-1)

    @staticmethod
    def _take(moves: _Moves, which: np.ndarray, place: np.ndarray, pivot: np.ndarray,
              gain: np.ndarray) -> None:
        """Keep the places that gain more than those known."""
        best = np.flatnonzero(gain > moves.gain[which])
        best = best[np.argsort(gain[best], kind="stable")]     # the greatest is written last
        moves.gain[which[best]], moves.place[which[best]] = gain[best], place[best]
        moves.above[which[best]] = pivot[which[best]]

    # What moves --------------------------------------------------------------------------------

    def _without_conflict(self, moves: _Moves) -> np.ndarray:
        """(m,) bool, those that may be made together; moves come the least gain first."""
        rank = np.arange(len(moves.node), dtype=np.int32)
        links = self._links(moves)
        taken = np.full(len(self.left), -1, np.int32)       # the highest rank that changes it
        for nodes in links:
            np.maximum.at(taken, nodes, rank)
        made = np.ones(len(rank), bool)
        for nodes in links:
            made &= taken[nodes] == rank
        # On the way down to a place nobody of a higher rank moves: round any ring of subtrees that
        # go into the next one's, ranks would rise for ever, so one of them stays.
        taken[:] = -1
        taken[moves.node[made]] = rank[made]
        on, way = rank[made], moves.place[made]
        while len(on):
            made[on[taken[way] > on]] = False
            further = way != moves.above[on]
            on, way = on[further], self.parent[way[further]]
        return made

    def _links(self, moves: _Moves) -> tuple[np.ndarray, ...]:
        """Nodes that a move changes: the subtree's, its parent, its sibling and the node above
        them, its new sibling and the node above that."""
        above = self.parent[moves.node]
        return (moves.node, above, self._sibling(moves.node), self.parent[above], moves.place,
                self.parent[moves.place])

    def _make(self, moves: _Moves, made: np.ndarray) -> None:
        """Make the moves; where they gain nothing together, the better half of them, and so on.
        ``made``, (m,) bool, is left as it came to be."""
        before = [values.copy() for values in (self.left, self.right, self.parent)]
        cost = self.cost
        while made.any():
            self._relink(moves.of(made))
            self._fit()
            if self.cost < cost or made.sum() == 1:
                return
            for values, old in zip((self.left, self.right, self.parent), before):
                values[:] = old
            made[np.flatnonzero(made)[:made.sum() // 2]] = False

    @property
    def cost(self) -> float:
        """The area of all boxes."""
        return float(self.area.sum(dtype=np.float64))

    def _fit(self) -> None:
        """Boxes around what the nodes hold now."""
        for nodes in reversed(tree_order.inner_levels(self.left, self.right)):
            self.box[nodes] = np.maximum(self.box[self.left[nodes]], self.box[self.right[nodes]])
        self.area = _half_area(self.box)

    def _relink(self, moves: _Moves) -> None:
        node, joint, sibling, above, place, around = self._links(moves)
        self._replace(above, joint, sibling)
        self._replace(around, place, joint)
        self.left[joint], self.right[joint] = place, node
        self.parent[place] = joint

    def _replace(self, above: np.ndarray, old: np.ndarray, new: np.ndarray) -> None:
        """Hang another child where the old one hung."""
        on_left = self.left[above] == old
        for side, there in ((self.left, on_left), (self.right, ~on_left)):
            side[above[there]] = new[there]
        self.parent[new] = above

    def _sibling(self, nodes: np.ndarray) -> np.ndarray:
        above = self.parent[nodes]
        return self.left[above] + self.right[above] - nodes


def _half_area(box: np.ndarray) -> np.ndarray:
    x, y, z = (box[:, axis] + box[:, 3 + axis] for axis in range(3))
    return x * y + y * z + z * x
