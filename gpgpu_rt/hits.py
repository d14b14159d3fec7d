"""Hits: the result of a trace, one entry per ray."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from . import views
from .errors import Error, OptionError, nearest_names
from .text_format import counted

TRACED, INVALID, UNFINISHED, STACK_OVERFLOW = 0, 1, 2, 3
COUNTERS = ("nodes_visited", "leaves_visited", "triangles_tested", "steps")


@dataclass
class Hits:
    """The nearest hits of n rays.

    Attributes
    ----------
    t : (n,) float, distance in units of the ray's |direction|; inf on a miss
    u, v : (n,) float, barycentric coordinates: p = (1 - u - v) v0 + u v1 + v v2; 0 on a miss
    triangle : (n,) int32, row of the hit triangle in the scene's faces; -1 on a miss
    status : (n,) uint8: 0 for a traced ray, 1 for an invalid ray, 2 if the step cap stopped the
        ray, 3 if its stack overflowed
    nodes_visited, leaves_visited, triangles_tested : (n,) int32, each ray's work; None without
        statistics
    steps : (n,) int32, number of kernel runs for each ray; None without statistics
    shape : shape of the ray arrays without their last axis: (n,), or (h, w) for (h, w, 3)
    """

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray
    status: np.ndarray
    nodes_visited: np.ndarray | None = None
    leaves_visited: np.ndarray | None = None
    triangles_tested: np.ndarray | None = None
    steps: np.ndarray | None = None
    shape: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        self.shape = tuple(self.shape) or (len(self.t),)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        facts = dict(self._facts())
        counts = ", ".join(facts[name] for name in ("hit", "miss", "invalid", "stopped")
                           if name in facts)
        return f"Hits({facts['rays']}: {counts}{'; t ' if facts['t'] else ''}{facts['t']})"

    def _repr_html_(self) -> str:
        picture = None
        if len(self.shape) == 2 and len(self):
            step = views.stride(max(self.shape), views.SIDE)
            triangle, t = (self.image(name)[::step, ::step] for name in ("triangle", "t"))
            picture = views.depth_picture(np.where(triangle >= 0, t, np.inf))
        return views.table("Hits", self._facts(), picture)

    def _facts(self) -> views.Facts:
        """Return how many rays have each outcome, the range of t, and the means of the counters.
        Above ``views.MOST_RAYS`` rays, estimate these facts from a sample of the rays."""
        step = views.stride(len(self), views.MOST_RAYS)
        status, triangle, t = self.status[::step], self.triangle[::step], self.t[::step]
        hit = (triangle >= 0) & (status == TRACED)
        stopped = int((status >= UNFINISHED).sum())
        invalid = int((status == INVALID).sum())
        miss = len(status) - int(hit.sum()) - stopped - invalid
        about, scale = "about " if step > 1 else "", len(self) / max(len(status), 1)
        facts = [("rays", counted(len(self), "ray")),
                 *((name, f"{about}{round(number * scale):,} {name}")
                   for name, number in (("hit", int(hit.sum())), ("miss", miss),
                                        ("invalid", invalid), ("stopped", stopped))
                   if number or name != "invalid"),
                 ("t", about + views.spread(t[hit]) if hit.any() else "")]
        if len(self.shape) == 2:
            facts.append(("shape", f"{self.shape[0]} x {self.shape[1]}"))
        means = ((name, getattr(self, name)) for name in COUNTERS)
        return [*facts, *((name.replace("_", " "), f"{about}{array[::step].mean():.2f} per ray")
                          for name, array in means if array is not None and len(self))]

    @property
    def hit(self) -> np.ndarray:
        """(n,) bool, true where a ray hit a triangle."""
        return self.triangle >= 0

    def image(self, name: str) -> np.ndarray:
        """Return the array ``name`` (a field, or "hit"): (h, w) for rays of shape (h, w, 3).

        Raises
        ------
        OptionError
            if there is no such array
        """
        known = [*self.to_dict(), "hit"]
        if name not in known:
            raise OptionError(f"hits have no array {name!r}{nearest_names(name, known)}")
        return getattr(self, name).reshape(self.shape)

    def to_dict(self) -> dict[str, Any]:
        """Return the arrays that are not None by field name, for ``numpy.savez``."""
        pairs = ((f.name, getattr(self, f.name)) for f in fields(self) if f.name != "shape")
        return {name: array for name, array in pairs if array is not None}


def check_decided(hits: Hits, step_cap: int) -> None:
    """Raise Error if the step cap or a full stack stopped a ray before a hit was found."""
    for status, advice in ((UNFINISHED, f"reached the step cap of {step_cap} before their "
                                        "search ended; raise step_cap"),
                           (STACK_OVERFLOW, "overflowed their stack; raise stack_size")):
        undecided = int(((hits.status == status) & ~hits.hit).sum())
        if undecided:
            raise Error(f"{undecided} rays {advice}")


def joined(parts: Sequence[Hits]) -> Hits:
    """Return the hits of several sets of rays as one set, in order."""
    found = [part.to_dict() for part in parts]
    return Hits(**{name: np.concatenate([one[name] for one in found]) for name in found[0]})
