"""A ray trip: the state of a call's rays while the host walks them through cells."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...accel.runs import chunks, expand
from ...gl.precision import FORMATS, Precision
from ...gl.record import Record
from ...gl.target import Target
from ...numerics.watertight import intersect_pairs
from ...rays.records import COUNTERS, HIT, NO_TRIANGLE
from ...traversal.accelerator import Accelerator
from ...traversal.schedules import DONE, UNFINISHED
from ...traversal.triangle_table import TRIANGLE
from .octree_walk import cell_walk
from .quads import Runs

MOST_PAIRS = 1 << 20       # pairs of ray and triangle that the host intersects together


class RayTrip:
    """The rays of one call.

    Attributes
    ----------
    record, rays : The record of the rays, and its fields as arrays.
    walk : The rays' positions in the cells.
    hit : The fields of HIT for the nearest hits so far. Before a ray's first hit, t is t_max.
    tested, leaves : Numbers of triangles tested and leaves visited by each ray, (n,) int32.
    phase : UNFINISHED for a ray that the step cap stopped, else DONE, (n,) int32.
    """

    def __init__(self, accelerator: Accelerator, options: Mapping[str, Any], step_cap: int,
                 record: Record, texels: np.ndarray, any_hit: bool) -> None:
        self.accelerator, self.options, self.step_cap = accelerator, options, step_cap
        self.record, self.rays = record, record.unpack(texels)
        self.grid, self.any_hit, rays = accelerator.structure, any_hit, self.rays
        unit = FORMATS[Precision.of(options).arithmetic].unit
        self.walk = cell_walk(self.grid, rays, unit)
        count = len(rays["t_max"])
        self.hit = {"t": rays["t_max"].copy(), "u": np.zeros(count, np.float32),
                    "v": np.zeros(count, np.float32),
                    "triangle": np.full(count, NO_TRIANGLE, np.int32)}
        self.tested, self.leaves, self.phase = np.zeros((3, count), np.int32)

    def enter(self, rays: np.ndarray) -> np.ndarray:
        """Select the rays that may test their cell's list within the step cap.

        Visited cells and tested triangles count as steps. Rays that would exceed the step cap
        become UNFINISHED.
        """
        steps = (self.walk.nodes_visited[rays] + self.tested[rays]
                 + self.walk.listed[self.walk.key[rays]])
        on = steps <= self.step_cap
        self.phase[rays[~on]] = UNFINISHED
        return rays[on]

    def ready(self, waiting: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sort waiting rays by cell, and choose the rays that are intersected now.

        Choose the rays in long queues (option ``queue``), or all rays if no queue is long.

        Returns
        -------
        chosen : the chosen rays that the GPU intersects
        waiting : the rays that keep waiting
        alone : the chosen rays in queues shorter than the option ``cpu_below``; the host
            intersects them
        """
        waiting = waiting[np.argsort(self.walk.key[waiting], kind="stable")]
        queues = Runs.of(self.walk.key[waiting])
        length = np.repeat(queues.count, queues.count)
        taken = length >= self.options["queue"]
        if not taken.any():
            taken[:] = True
        here = taken & (length < self.options["cpu_below"])
        return waiting[taken & ~here], waiting[~taken], waiting[here]

    def fields(self, chosen: np.ndarray) -> dict[str, np.ndarray]:
        """Return the fields of the rays ``chosen``. t_max is the t of the nearest hit so far."""
        return {**{name: values[chosen] for name, values in self.rays.items()},
                "t_max": self.hit["t"][chosen]}

    def take(self, rays: np.ndarray, found: dict[str, np.ndarray]) -> None:
        """Keep each ray's nearer hit: the known hit or ``found``; at equal t, the lower index."""
        t, known = found["t"], self.hit["t"][rays]
        better = (found["triangle"] != NO_TRIANGLE) & (
            (t < known) | ((t == known) & (found["triangle"] < self.hit["triangle"][rays])))
        for name, values in self.hit.items():
            values[rays[better]] = found[name][better]

    def intersect_here(self, rays: np.ndarray, split: dict[str, float]) -> None:
        """Intersect rays on the host by the numpy twin of the watertight test."""
        key = self.walk.key[rays]
        counts = self.walk.listed[key]
        triangles = self.accelerator.tables[TRIANGLE.name]
        for part in chunks(counts, MOST_PAIRS):
            some, many = rays[part], counts[part]
            owner = np.repeat(some, many)
            row = self.grid.references[expand(
                self.grid.cell_start[key[part]].astype(np.int64), many)]
            corners = np.stack([triangles[name].make(row) for name in ("v0", "v1", "v2")], axis=1)
            accepted, t, u, v = intersect_pairs(corners, self.rays["origin"][owner],
                                                self.rays["direction"][owner])
            t_min = self.rays["t_min"][owner]
            accepted &= (t >= t_min) & (t <= self.hit["t"][owner])
            if "after" in self.rays:    # as in accept() of core/triangle.glsl
                accepted &= (t > t_min) | (row > self.rays["after"][owner])
            at = np.flatnonzero(accepted)
            at = at[np.lexsort((row[at], t[at], owner[at]))]
            at = at[np.diff(owner[at], prepend=-1) != 0]     # keep the first hit of each ray
            self.take(owner[at], {"t": t[at], "u": u[at], "v": v[at], "triangle": row[at]})
            split["pairs"] += len(row)
        split["host_rays"] += len(rays)

    def onward(self, rays: np.ndarray) -> np.ndarray:
        """Move rays from tested cells to the next cells that list triangles.

        Return the rays that reach such cells within the step cap.
        """
        self.leaves[rays] += 1
        self.tested[rays] += self.walk.listed[self.walk.key[rays]]
        if self.any_hit:
            rays = rays[self.hit["triangle"][rays] == NO_TRIANGLE]
        return self.enter(self.walk.onward(rays, self.hit["t"]))

    def write(self, final: Target, state: str) -> None:
        """Write hits, states and counters to the buffer that the tracer reads."""
        visited = self.walk.nodes_visited
        steps = np.minimum(visited + self.tested, self.step_cap)
        over = (self.phase == DONE) & (visited + self.tested > self.step_cap)
        self.phase[over] = UNFINISHED
        steps[self.phase == UNFINISHED] = self.step_cap
        final.write(state, phase=self.phase, steps=steps)
        final.write(HIT.name, **self.hit)
        if COUNTERS.name in final.records:
            final.write(COUNTERS.name, nodes_visited=visited, leaves_visited=self.leaves,
                        triangles_tested=self.tested)
