"""Reinsertion: remove subtrees of a finished tree and insert them where they cost least.

D. Meister, J. Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", CGF
37(2), 2018. All subtrees search at once for their best places. A place is a node. A move replaces
the place by a new inner node with two children: the place and the subtree. The gain of a move is
the decrease of the sum of all inner nodes' areas. A move is not made if it conflicts with a move
of greater gain.

As in the paper, the search climbs from ancestor to ancestor. Departures: below each ancestor, it
goes down level by level, because numpy processes many nodes at once. A subtree whose move
conflicted searches again in the same round. Two moves conflict if they change the links of the
same node, or if the place of one move lies in the subtree that the other moves. If the moves
together gain nothing, only the half with the greater gains is made.
"""
from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ...accel import tree_order
from ...threads import threads
from .tree import LooseTree

AT_ONCE = 1 << 14   # nodes that search together; their data stays in a core's cache
WORTH = 0.03        # a round ends if less than this share of the last search's moves was made


def reinserted(tree: LooseTree, triangles: np.ndarray, rounds: int) -> LooseTree:
    """Return a tree of the same leaves, with a lower cost if moves can lower the cost.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    rounds : largest number of rounds; the first two rounds bring most of the gain
    """
    if not rounds or len(tree.left) < 5:     # in a smaller tree, no subtree can move elsewhere
        return tree
    tables = _Tables(tree, triangles)
    for _ in range(rounds):
        if not tables.round():
            break
    return LooseTree(tables.left.astype(np.int64), tables.right.astype(np.int64), tree.count,
                     tree.triangle)


@dataclass
class _Moves:
    """Moves of subtrees.

    Attributes
    ----------
    node : (m,) int32, roots of subtrees
    place : (m,) int32, the new sibling of each subtree
    above : (m,) int32, the lowest common ancestor of `node` and `place`
    gain : (m,) float32, the area that the move saves
    """

    node: np.ndarray
    place: np.ndarray
    above: np.ndarray
    gain: np.ndarray

    def of(self, some: np.ndarray) -> _Moves:
        return _Moves(*(getattr(self, field.name)[some] for field in fields(self)))


class _Tables:
    """The tree during its optimisation. Nodes keep their numbers.

    Attributes
    ----------
    left, right, parent : (n,) int32, the children and the parent of each node, or -1
    box : (n, 6) float32, the negated lower corner and the upper corner of each node's box, so that
        a maximum joins boxes. Coordinates are relative to the scene's centre, in units of the
        scene's largest side
    area : (n,) float32, half of each box's surface area
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
        """Let all nodes but the root and its children move. Return the number of moves."""
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
        """Return the best move of each subtree that can gain, in ascending order of gain."""
        parts = np.split(nodes, range(AT_ONCE, len(nodes), AT_ONCE))
        found = list(threads(len(nodes))(self._search, parts))
        moves = _Moves(*(np.concatenate([getattr(part, field.name) for part in found])
                         for field in fields(_Moves)))
        return moves.of(np.argsort(moves.gain, kind="stable"))

    def _search(self, nodes: np.ndarray) -> _Moves:
        parent, area, box = self.parent, self.area, self.box
        moves = _Moves(nodes, np.full(len(nodes), -1, np.int32), parent[nodes],
                       np.zeros(len(nodes), np.float32))
        pivot = parent[nodes]           # the current ancestor; search below its child `sibling`
        sibling = self._sibling(nodes)
        beside = box[sibling]           # the pivot's box without the subtree
        freed = area[pivot]             # area that the subtree's removal saves, up to the pivot
        on = np.arange(len(nodes))
        while len(on):
            self._search_below(moves, on, pivot, sibling[on], freed[on])
            on = on[pivot[on] > 0]
            # The subtree's removal removes its parent and shrinks the boxes of higher ancestors.
            high = on[pivot[on] != parent[nodes[on]]]
            beside[high] = np.maximum(beside[high], box[sibling[high]])
            freed[high] += area[pivot[high]] - _half_area(beside[high])
            # The pivot is a place, too. The new parent of pivot and subtree has the pivot's old
            # box and costs its area.
            self._store_better(moves, high, pivot[high], pivot, freed[high] - area[pivot[high]])
            sibling[on] = self._sibling(pivot[on])
            pivot[on] = parent[pivot[on]]
        return moves.of(moves.place >= 0)

    def _search_below(self, moves: _Moves, which: np.ndarray, pivot: np.ndarray,
                      place: np.ndarray, left_over: np.ndarray) -> None:
        """Try the given places and all places below them.

        Parameters
        ----------
        which : (k,) int, indices of moves, ascending; an index may occur several times
        pivot : (m,) int, the current ancestor of each move
        place : (k,) int, a place for each entry of `which`
        left_over : (k,) float32, the area that the subtree's removal saves, minus the area by
            which the nodes between pivot and place grow
        """
        while True:
            # Prune places that cannot gain more: the new parent's area is at least the subtree's.
            hope = np.flatnonzero(left_over - self.area[moves.node[which]] > moves.gain[which])
            if not len(hope):
                return
            which, place = which[hope], place[hope]
            joined = _half_area(np.maximum(self.box[place], self.box[moves.node[which]]))
            gain = left_over[hope] - joined
            self._store_better(moves, which, place, pivot, gain)
            inner = np.flatnonzero(self.left[place] >= 0)
            which, place = which[inner], place[inner]
            left_over = np.repeat(gain[inner] + self.area[place], 2)
            which = np.repeat(which, 2)
            place = np.stack([self.left[place], self.right[place]], axis=1).reshape(-1)

    @staticmethod
    def _store_better(moves: _Moves, which: np.ndarray, place: np.ndarray, pivot: np.ndarray,
                      gain: np.ndarray) -> None:
        """Store the places that gain more than the places found so far."""
        best = np.flatnonzero(gain > moves.gain[which])
        best = best[np.argsort(gain[best], kind="stable")]     # the greatest gain is written last
        moves.gain[which[best]], moves.place[which[best]] = gain[best], place[best]
        moves.above[which[best]] = pivot[which[best]]

    # The moves ---------------------------------------------------------------------------------

    def _without_conflict(self, moves: _Moves) -> np.ndarray:
        """Return which moves to make, (m,) bool, without conflicts. `moves` ascends by gain."""
        rank = np.arange(len(moves.node), dtype=np.int32)
        links = self._links(moves)
        taken = np.full(len(self.left), -1, np.int32)   # highest rank of moves that change a node
        for nodes in links:
            np.maximum.at(taken, nodes, rank)
        made = np.ones(len(rank), bool)
        for nodes in links:
            made &= taken[nodes] == rank
        # Drop a move if a node on the path from `above` down to `place` moves with a higher rank.
        # This breaks every cycle of subtrees that move into each other.
        taken[:] = -1
        taken[moves.node[made]] = rank[made]
        on, way = rank[made], moves.place[made]
        while len(on):
            made[on[taken[way] > on]] = False
            further = way != moves.above[on]
            on, way = on[further], self.parent[way[further]]
        return made

    def _links(self, moves: _Moves) -> tuple[np.ndarray, ...]:
        """Return the nodes whose links each move changes."""
        above = self.parent[moves.node]
        return (moves.node, above, self._sibling(moves.node), self.parent[above], moves.place,
                self.parent[moves.place])

    def _make(self, moves: _Moves, made: np.ndarray) -> None:
        """Make the moves that ``made``, (m,) bool, marks.

        While they do not lower the cost together, undo and unmark them, and make only the half
        with the greater gains. A single move is always made.
        """
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
        """The sum of the half areas of all boxes."""
        return float(self.area.sum(dtype=np.float64))

    def _fit(self) -> None:
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
