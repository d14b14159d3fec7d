"""The Ray Engine: the host walks rays through cells, and GPU passes intersect batches of rays.

Rays that wait for the triangles of the same cell form the cell's queue.
"""
from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl
import numpy as np

from ...accel.runs import chunks, expand
from ...gl.record import Record
from ...gl.target import Target
from ...gl.textures import read_texture, texture_bytes
from ...rays.records import RAY_AFTER_HIT, RAY_TEXELS
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ...traversal.driver import UNFINISHED, MethodDriver
from .quads import BatchTargets, Runs
from .ray_trip import RayTrip

MOST_QUADS = 1 << 20       # limit on the quads of a draw; larger batches are drawn in parts
QUAD = np.dtype([("rectangle", "<f4", 4), ("row", "<i4")])


class RayEngine(MethodDriver):
    """The driver of a method whose rays the host walks through cells.

    Each round selects the long queues, or all queues if none is long. Passes intersect their rays
    in batches. Then the host walks these rays to their next cells. For each batch, the host
    uploads the rays and the quads, and reads back the hits. A quad is a rectangle over rays, drawn
    for one triangle.
    """

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        self.gpu.context.enable_only(moderngl.NOTHING)
        split = statistics.split
        for name in ("traversal_seconds", "transfer_seconds", "intersection_seconds",
                     "host_intersection_seconds", "bytes_up", "bytes_down", "batches",
                     "quads", "pairs", "host_rays"):
            split.setdefault(name, 0.0 if name.endswith("seconds") else 0)
        with clocked(split, "transfer_seconds"):
            texels = np.stack([read_texture(texture).reshape(-1, 4)
                               for texture in rays.complete().textures], axis=1)
            split["bytes_down"] += texture_bytes(rays.textures)
        trip = RayTrip(self.accelerator, self.options, self.step_cap,
                       RAY_AFTER_HIT if rays.after_hit else RAY_TEXELS, texels, any_hit)
        with clocked(split, "traversal_seconds"):
            waiting = trip.enter(trip.walk.start(trip.hit["t"]))
        while len(waiting):
            with clocked(split, "traversal_seconds"):
                chosen, waiting, alone = trip.ready(waiting)
            if len(alone):
                with clocked(split, "host_intersection_seconds"):
                    trip.intersect_here(alone, split)
            for begin in range(0, len(chosen), self.options["batch"]):
                self._batch(trip, chosen[begin:begin + self.options["batch"]], statistics)
            with clocked(split, "traversal_seconds"):
                onward = trip.onward(np.concatenate([chosen, alone]))
                waiting = np.concatenate([waiting, onward])
        final = buffers.side(0)
        with clocked(split, "transfer_seconds"):
            trip.write(final, self.method.state.name)
            split["bytes_up"] += texture_bytes(final.textures)
            self.gpu.finish()
        return final, int((trip.phase == UNFINISHED).sum())

    # A batch --------------------------------------------------------------------------------

    def _batch(self, trip: RayTrip, chosen: np.ndarray, statistics: Statistics) -> None:
        """Intersect the rays ``chosen``, (k,) int, sorted by cell, with their cells' triangles."""
        split, batch = statistics.split, self._batch_for(len(trip.phase), trip.record)
        with clocked(split, "traversal_seconds"):
            runs = Runs.of(trip.walk.key[chosen])
            corners, owner = runs.rectangles()
            listed = trip.walk.listed[runs.cell][owner]
            starts = self.accelerator.structure.cell_start[runs.cell].astype(np.int64)[owner]
            fields = trip.fields(chosen)
            depth_end = max(float(trip.walk.t_exit[chosen].max()), 1e-30)
        with clocked(split, "transfer_seconds"):
            split["bytes_up"] += batch.upload(fields)
            self.gpu.finish()
        parts = chunks(listed, MOST_QUADS)
        for part in parts:
            with clocked(split, "traversal_seconds"):
                quads = np.zeros(int(listed[part].sum()), QUAD)
                quads["rectangle"] = np.repeat(corners[part], listed[part], axis=0)
                quads["row"] = self.accelerator.structure.references[expand(
                    starts[part], listed[part])]
            with clocked(split, "transfer_seconds"):
                buffer = self._buffer(quads)
                split["bytes_up"] += quads.nbytes
                self.gpu.finish()
            with clocked(split, "intersection_seconds"):
                for keep in batch.passes:
                    batch.draw_quads(keep, trip.any_hit, self.samplers, self.accelerator, buffer,
                                     len(quads), depth_end)
                batch.draw_left(self.samplers, self.accelerator)
                self.gpu.finish()
            for _ in range(len(batch.passes) + 1):
                self.count_pass(statistics)
            split["quads"] += len(quads)
            with clocked(split, "transfer_seconds"):
                hits, size = batch.read(len(chosen))
                split["bytes_down"] += size
            with clocked(split, "traversal_seconds"):
                trip.take(chosen, hits)
        split["batches"] += 1
        split["pairs"] += int((runs.count * trip.walk.listed[runs.cell]).sum())

    def _buffer(self, quads: np.ndarray) -> moderngl.Buffer:
        buffer = self.keep(
            "quads", lambda: self.gpu.context.buffer(
                reserve=1 << max(16, int(quads.nbytes - 1).bit_length()), dynamic=True),
            lambda buffer: buffer.size >= quads.nbytes)
        buffer.write(quads)
        self.gpu.note_moved(up=quads.nbytes)
        return buffer

    def _batch_for(self, rays: int, record: Record) -> BatchTargets:
        rays = min(rays, self.options["batch"])
        return self.keep(
            "batch",
            lambda: BatchTargets(self.setup, rays, self.options["nearest"] == "depth", record),
            lambda batch: batch.size[0] * batch.size[1] >= rays and batch.record == record)


@contextmanager
def clocked(split: dict[str, float], name: str) -> Iterator[None]:
    """Add the block's duration, in seconds, to ``split[name]``."""
    began = time.perf_counter()
    yield
    split[name] += time.perf_counter() - began
