"""Session: a method with its options over a scene."""
from __future__ import annotations

import time
from contextlib import ExitStack
from typing import Any

import numpy as np

from ..gl.context import Gpu
from ..gl.record import EXACT_INTEGER
from ..gl.target import ByRay, Target, whole
from ..gl.textures import release
from ..hits import Hits
from ..methods import Accelerator, Method, find_method
from ..rays.batch import RayBatch
from ..rays.records import COUNTERS, HIT
from ..scene.scene import Scene
from ..statistics import Statistics
from ..traversal.assembly import make_driver
from ..traversal.driver import Driver, Setup
from ..traversal.packet_hits import PacketHits
from ..traversal.schedules import mark_stopped
from ..traversal.stages.eye_drivers import EyeDrivers
from .all_hits import AllHits, collect
from .ray_buffers import RayBuffers
from .scene_tables import SceneTables
from .structure import Structure


class Session:
    """A method with its options over a scene, ready to trace.

    Parameters
    ----------
    method, options : the method's row in the method table, and a value for each option
    structure : the structure to trace through; None builds a structure

    Attributes
    ----------
    structure : scene, accelerator and tables
    driver : runs the method's passes
    eye_drivers : drivers for eye rays, for which the rasteriser finds the hits or bounds of t
    buffers : textures of rays and states
    build_seconds, refit_seconds, rebuilt : as in ``Statistics``
    """

    def __init__(self, gpu: Gpu, method: Method, options: dict[str, Any], scene: Scene,
                 structure: Structure | None = None) -> None:
        began = time.perf_counter()
        self.gpu, self.method, self.options = gpu, method, options
        with gpu, ExitStack() as undo:
            self.eye_drivers = EyeDrivers(gpu, method, options)
            undo.callback(release, self.eye_drivers)
            self._borrowed = structure is not None
            if structure is None:
                structure = Structure(gpu, method, options, scene)
                undo.callback(release, structure)
            self.structure = structure
            self.driver = self._make_driver()
            undo.pop_all()
        self.buffers = RayBuffers(gpu, method.state, structure.precision, options["statistics"])
        self.build_seconds, self.refit_seconds = time.perf_counter() - began, 0.0
        self.rebuilt = False

    def _make_driver(self) -> Driver:
        return make_driver(Setup(self.gpu, self.method, self.tables.samplers(),
                                 self.accelerator, self.options, self.step_cap, find_method,
                                 self.structure.adopt))

    @property
    def scene(self) -> Scene:
        return self.structure.scene

    @property
    def accelerator(self) -> Accelerator:
        return self.structure.accelerator

    @property
    def tables(self) -> SceneTables:
        return self.structure.tables

    @property
    def step_cap(self) -> int:
        """Number of steps after which a ray is stopped and flagged."""
        return min(self.options["step_cap"] or self.accelerator.step_bound + 1, EXACT_INTEGER - 1)

    def costs(self) -> dict[str, Any]:
        """Return the entries of ``Statistics`` about the structure, by name."""
        return {"method": self.method.name, "table_bytes": self.structure.table_bytes,
                "build_seconds": self.build_seconds, "refit_seconds": self.refit_seconds,
                "rebuilt": self.rebuilt}

    def counting(self) -> Session:
        """Return a session with ``statistics=True`` over the same structure."""
        counting = Session(self.gpu, self.method, {**self.options, "statistics": True},
                           self.scene, self.structure)
        counting.build_seconds, counting.refit_seconds = self.build_seconds, self.refit_seconds
        counting.rebuilt = self.rebuilt
        return counting

    # Tracing --------------------------------------------------------------------------------

    def trace(self, batch: RayBatch, any_hit: bool, statistics: Statistics) -> Hits:
        """Return the nearest hit of each ray; with ``any_hit``, any hit of each ray."""
        with self.gpu:
            statistics.start_call(batch.count)
            self._sort(batch)
            rays, buffers = self.buffers.of(batch.size)
            began = time.perf_counter()
            rays.upload(batch)
            self.gpu.finish()
            uploaded = time.perf_counter()
            side, stopped = self.driver.run(rays, buffers, statistics, any_hit)
            self.gpu.finish()
            traced, sorting = time.perf_counter(), batch.sort_seconds
            statistics.stopped = stopped
            hits = batch.hits(side.fields(HIT.name, batch.by_ray))
            self.finish(hits, side, statistics, batch.by_ray)
            self.gpu.check_error(f"tracing {batch.count} rays")
        statistics.sort_seconds += batch.sort_seconds
        statistics.upload_seconds = uploaded - began
        statistics.trace_seconds = traced - uploaded + batch.sort_seconds
        back = time.perf_counter() - traced
        statistics.readback_seconds = back - (batch.sort_seconds - sorting)
        return hits

    def trace_all(self, batch: RayBatch, max_hits: int | None,
                  statistics: Statistics) -> AllHits:
        """Return all hits of each ray, or only each ray's ``max_hits`` nearest hits."""
        def trace_on(texels: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
            """Return the fields of HIT and the status of each ray; see `all_hits.Round`."""
            rays, buffers = self.buffers.of(texels.shape[1::-1], after_hit=True)
            rays.write(texels)
            side, stopped = self.driver.run(rays, buffers, statistics)
            statistics.stopped += stopped
            fields, status = side.fields(HIT.name), np.zeros(texels[..., 0, 0].size, np.uint8)
            if stopped:
                mark_stopped(status, side.fields(self.method.state.name)["phase"])
            return fields, status

        statistics.start_call(batch.count)
        self._sort(batch)
        began = time.perf_counter()
        hits = collect(batch, trace_on, max_hits)
        self.gpu.check_error(f"tracing all hits of {batch.count} rays")
        statistics.trace_seconds = time.perf_counter() - began + batch.sort_seconds
        statistics.sort_seconds += batch.sort_seconds
        return hits

    def _sort(self, batch: RayBatch) -> None:
        if self.options["presort"]:
            batch.put_in_order(self.structure.bounds, self.structure.precision)

    def finish(self, hits: Hits, side: Target | PacketHits, statistics: Statistics,
               by_ray: ByRay = whole) -> None:
        """Add the status of stopped rays, and the counters, to the hits."""
        if statistics.stopped:
            mark_stopped(hits.status, side.fields(self.method.state.name, by_ray)["phase"])
        if self.options["statistics"]:
            for name, values in self.count(side, statistics, by_ray).items():
                setattr(hits, name, values)

    def count(self, side: Target | PacketHits, statistics: Statistics,
              by_ray: ByRay = whole) -> dict[str, np.ndarray]:
        """Return the rays' counters by name, and put their means into the statistics."""
        counters = {**side.fields(COUNTERS.name, by_ray),
                    "steps": side.fields(self.method.state.name, by_ray)["steps"]}
        statistics.counters = {name: float(values.mean()) if len(values) else 0.0
                               for name, values in counters.items()}
        return counters

    def eye_driver(self, first_hits: str) -> Driver:
        """Return the driver that traces a picture's rays; see `EyeDrivers.over`."""
        return self.eye_drivers.over(self.driver, first_hits, self.structure.hit_triangles)

    # Moving ---------------------------------------------------------------------------------

    def move(self, scene: Scene, built: Accelerator | None = None) -> None:
        """From now on, trace ``scene``: the same scene with moved triangles.

        ``built`` is a finished accelerator over the moved triangles, or None.
        """
        began = time.perf_counter()
        with self.gpu:
            moved = self.structure.move(scene, built)
            if moved.same_programs:
                self.follow()
            else:       # the programs or the stack's depth changed
                self.driver.release()
                self.driver = self._make_driver()
            self.follow_eye(known=True)
        took = time.perf_counter() - began
        self.rebuilt, self.refit_seconds = moved.rebuilt, moved.tried_seconds
        if moved.rebuilt:
            self.build_seconds = took - moved.tried_seconds
        else:
            self.refit_seconds = took

    def follow(self) -> None:
        self.driver.follow(self.tables.samplers(), self.accelerator, self.step_cap)

    def follow_eye(self, known: bool) -> None:
        """Give the rasteriser the moved triangles. If the host does not know their positions
        (``known`` is False), drop the rasteriser's triangles."""
        if known:
            self.eye_drivers.take(self.structure.hit_triangles, self.driver)
        else:
            self.eye_drivers.lose_triangles()

    # Lifetime -------------------------------------------------------------------------------

    def bytes(self) -> int:
        return (sum(self.structure.table_bytes.values()) + self.buffers.bytes()
                + self.driver.bytes() + self.eye_drivers.bytes())

    def release(self) -> None:
        """Free textures and programs, but not the caller's structure."""
        release(self.buffers, self.eye_drivers, self.driver)
        if not self._borrowed:
            self.structure.release()
