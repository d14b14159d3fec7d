"""Small world: a few triangles that stand on a plane, their kd-tree, and one ray.

`walk` traces the ray by the passes of a given method and reads the ray's state after each pass.
The triangles are low, so no split across z lowers the cost, and the ray is parallel to the plane.
Seen from above, tree and ray are therefore two-dimensional, as the survey draws them.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.inspect.observe import ObservedPass, observe_states
from gpgpu_rt.methods.kdtree.ropes import Ropes, build_ropes
from gpgpu_rt.methods.kdtree.tree import LEAF as KD_LEAF_AXIS
from gpgpu_rt.methods.kdtree.tree import KdTree

SEED, COUNT, HEIGHT, MAX_DEPTH = 1, 6, 0.05, 3
BVH = {"build": "kay-kajiya"}      # as Thrane and Simonsen drew it: one triangle per leaf
ORIGIN, DIRECTION = (0.7, 0.64), (-0.9, 0.37)


@dataclass(frozen=True)
class World:
    """The scene, its tree and its ray.

    triangles : (n, 3, 3) float32.
    lo, hi : (nodes, 3) float32, the boxes of the tree's nodes.
    origin, direction : (3,) float32. The magnitude of the direction's largest component lies in
        [0.5, 1). A tracer scales directions by a power of two to this range, so the tracer keeps
        this direction, and the kernels' t equals the caller's t.
    """

    scene: rt.Scene
    triangles: np.ndarray
    tree: KdTree
    lo: np.ndarray
    hi: np.ndarray
    origin: np.ndarray
    direction: np.ndarray

    @property
    def parents(self) -> np.ndarray:
        return self.tree.parents()

    @property
    def ropes(self) -> Ropes:
        return build_ropes(self.tree)

    def is_leaf(self, node: int) -> bool:
        return bool(self.tree.axis[node] == KD_LEAF_AXIS)

    def name(self, node: int) -> str:
        """Return S0, S1, ... for splits, n0, n1, ... for leaves, as in the survey's Figure 9."""
        leaf = self.tree.axis == KD_LEAF_AXIS
        same = leaf if leaf[node] else ~leaf
        return f"{'n' if leaf[node] else 'S'}{int(same[:node].sum())}"

    def inside(self, node: int) -> list[int]:
        """Return the triangles that a leaf lists."""
        first = self.tree.left[node]
        return self.tree.references[first:first + self.tree.count[node]].tolist()

    def at(self, t: float) -> np.ndarray:
        return self.origin.astype(np.float64) + t * self.direction.astype(np.float64)

    def plane_t(self, node: int) -> float:
        """Return the ray's t at a split's plane, rounded as in the kernels."""
        axis = self.tree.axis[node]
        inverse = np.float32(1) / self.direction[axis]
        return float((self.tree.split[node] - self.origin[axis]) * inverse)


def standing_triangles(seed: int, count: int) -> np.ndarray:
    """Return (count, 3, 3) float32: bases on the plane z = 0, tips above the bases' middles."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(0.12, 0.88, (count, 2))
    angle, half = rng.uniform(0, np.pi, count), rng.uniform(0.06, 0.14, count)
    along = half[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    low, high = np.zeros((count, 1)), np.full((count, 1), HEIGHT)
    return np.stack([np.hstack([middle - along, low]), np.hstack([middle + along, low]),
                     np.hstack([middle, high])], axis=1).astype(np.float32)


@lru_cache(maxsize=None)
def world(seed: int = SEED, origin: tuple[float, float] = ORIGIN,
          direction: tuple[float, float] = DIRECTION) -> World:
    triangles = standing_triangles(seed, COUNT)
    corners = triangles.reshape(-1, 3)
    camera = rt.Camera.looking_at((corners.min(axis=0), corners.max(axis=0)))
    scene = rt.Scene.from_arrays(corners, np.arange(3 * COUNT).reshape(-1, 3), camera=camera)
    with rt.Tracer(scene, "kd-restart", max_depth=MAX_DEPTH) as tracer:
        tree = tracer.accelerator.structure
    # Start near the ground, where a triangle is almost as wide as its base.
    start = np.float32([*origin, 0.02 * HEIGHT])
    return World(scene, triangles, tree, *tree.boxes(), start, np.float32([*direction, 0]))


@dataclass(frozen=True)
class Step:
    """A pass's kernel, and the ray's state before and after the pass."""

    kernel: str
    before: dict[str, Any]
    after: dict[str, Any]
    hit: dict[str, Any]

    @property
    def visited(self) -> int | None:
        """The node that the kernel read to choose the next node, or None."""
        return {"down": self.before["node"], "traverse": self.before["node"],
                "climb": self.after["node"]}.get(self.kernel)


@dataclass(frozen=True)
class Walk:
    """The steps of the ray by one method, and the tracer's hits with step counters."""

    method: str
    steps: list[Step]
    hits: rt.Hits

    @property
    def visited(self) -> list[int]:
        return [step.visited for step in self.steps if step.visited is not None]


def walk(method: str, small: World | None = None) -> Walk:
    """Trace the ray of ``small`` (by default of ``world()``), one step per pass."""
    return _own_walk(method) if small is None else _walk(method, small)


@lru_cache(maxsize=None)
def _own_walk(method: str) -> Walk:
    return _walk(method, world())


def _walk(method: str, small: World) -> Walk:
    states: list[tuple[dict[str, Any], dict[str, Any]]] = []
    build = {"max_depth": MAX_DEPTH} if method.startswith("kd-") else BVH
    with rt.Tracer(small.scene, method, schedule="step", statistics=True, **build) as tracer:
        row = tracer.method

        def look(one: ObservedPass) -> None:
            states.append(tuple({name: values[0].item() if values.ndim == 1 else values[0]
                                 for name, values in one.target.fields(record).items()}
                                for record in (row.state.name, "hit")))
        with observe_states(tracer, look):
            hits = tracer.trace(small.origin[None], small.direction[None])
    steps = [Step(row.kernels[before["phase"] - 1], before, after, hit)
             for (before, _), (after, hit) in zip(states, states[1:])
             if after["steps"] > before["steps"]]
    return Walk(method, steps, hits)
