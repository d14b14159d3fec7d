"""Tracer: a scene, a method and a context, ready to trace."""
from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh

from .errors import Error, memory_limited
from .gl.context import open_gpu
from .gl.pass_log import PassLog, logged
from .gl.precision import Precision
from .gl.record import EXACT_INTEGER
from .gl.textures import release, texture_bytes
from .hits import STACK_OVERFLOW, UNFINISHED, Hits
from .methods import Accelerator, Method, find_method, settings
from .methods.choices import COHERENT, RAYS, Choice, Choices
from .rays.batch import RayBatch
from .rays.records import COUNTERS, HIT
from .rays.textures import ByRay, RayTextures, StateBuffer, StateBuffers, whole
from .render.integrators import Integrator
from .scene.loading import load_scene
from .scene.scene import Scene
from .session.all_hits import AllHits, check_exact, collect
from .session.builder import Builder
from .session.choosing import Choosing
from .session.moving import Moving
from .session.pictures import Pictures
from .session.scene_tables import SceneTables
from .statistics import Statistics
from .traversal.assembly import make_driver
from .traversal.driver import Driver, Samplers, Setup
from .traversal.method import Tables
from .traversal.packet_hits import PacketHits
from .traversal.schedules import mark_stopped
from .traversal.stages.eye_drivers import EyeDrivers

DEFAULT_METHOD = "bvh-threaded"
AUTO = "auto"


class Tracer(Choosing, Moving, Pictures):
    """Traces rays through a scene with one of the table's methods.

    Parameters
    ----------
    scene : Scene, trimesh.Trimesh, a scene's name or a mesh file
    method : a name from ``methods()``; or "auto": what `tune` found for this scene and renderer
        where it was run, else a safe default. These are ``Choices``, one for coherent rays and one
        for others, which may be given too: each call takes between them by the rays it is given,
        and the structure for incoherent ones is built when such rays first come.
        ``statistics.choice`` says which was taken; ``method`` and ``options`` are its
    options : those of ``options.TRACER_OPTIONS`` and the method's own; any other is refused

    Raises
    ------
    OptionError, SceneError, ContextError, ShaderError, LimitError

    Notes
    -----
    A ``with`` block, or ``release``, frees textures and programs. Threads may share a tracer or
    have one each: they take turns at the context (``statistics`` is then of whoever came last).
    Processes have one each, and start by "spawn", for a context does not outlive a fork; a tracer
    that is pickled is made again there, with the same scene, method and options.
    """

    @memory_limited
    def __init__(self, scene: Scene | trimesh.Trimesh | str | os.PathLike[str],
                 method: str | Choices = DEFAULT_METHOD, **options: Any) -> None:
        self.settings: settings.Settings | None = None   # what "auto" and from_settings took
        if method == AUTO:
            scene = load_scene(scene)
            method, self.settings = settings.automatic(
                scene, open_gpu(options.get("context")).renderer, options)
        elif isinstance(method, Choices):
            method = method.with_options(options, "the choices")
        else:
            method = Choices.one(Choice(method, options))
        self.choices, self.taken, self._aside = method, COHERENT, None
        self._rows = {rays: method.of(rays).resolved() for rays in RAYS}
        self.scene = load_scene(scene)
        self.gpu = open_gpu(self._rows[COHERENT][1]["context"])
        self.statistics = Statistics()
        self._tiled = any(row.packet for row, _ in self._rows.values())
        self._rays: RayTextures | None = None
        self._buffers: StateBuffers | None = None
        self._integrator: Integrator | None = None
        self.pass_log: PassLog | None = None    # of the last call, with statistics=True
        self._counting = self._released = False
        self._open()

    def _open(self) -> None:
        """Build what the choice taken traces with."""
        began = time.perf_counter()
        self.method, self.options = self._rows[self.taken]
        self.precision = Precision.of(self.options)
        self._bounds = self.scene.bounds
        self._builder = Builder(self.method, self.options, self.scene.charts)
        self._triangles = self._builder.stored(self.scene)
        self._tables = SceneTables(self.gpu, self.precision)
        self._eye_drivers = EyeDrivers(self.gpu, self.method, self.options)
        with self.gpu, ExitStack() as undo:
            undo.callback(release, self._eye_drivers)
            undo.callback(self._tables.keep, ())
            self.accelerator = self._builder.build(self._triangles)
            undo.callback(release, self.accelerator.finisher)
            self._write_tables(self.method.tables_for(self.options), self.accelerator)
            self._traversal = self._make_traversal()
            undo.pop_all()
        self.statistics.__dict__.update(
            method=self.method.name, choice=self.taken if self.choices.differ else "",
            build_seconds=time.perf_counter() - began, refit_seconds=0.0, rebuilt=False)

    @classmethod
    def from_settings(cls, scene: Scene | trimesh.Trimesh | str | os.PathLike[str],
                      path: str | os.PathLike[str], force: bool = False,
                      **options: Any) -> Tracer:
        """A tracer with the choices of a settings file.

        Parameters
        ----------
        path : a file that `gpgpu-rt tune` wrote
        force : take it for another scene or renderer too; its promise then holds no longer
        options : more options; one that the file decides is refused

        Raises
        ------
        SettingsError, OptionError
            besides what the constructor raises; the difference is named
        """
        found, scene = settings.load(path), load_scene(scene)
        if not force:
            found.check_fits(scene, open_gpu(options.get("context")).renderer, str(path))
        tracer = cls(scene, found.choices.with_options(options, str(path)))
        tracer.settings = found
        return tracer

    @property
    def step_cap(self) -> int:
        """Steps after which a ray is stopped and flagged."""
        return min(self.options["step_cap"] or self.accelerator.step_bound + 1, EXACT_INTEGER - 1)

    def _write_tables(self, records: Tables, accelerator: Accelerator) -> None:
        self._tables.write(records, accelerator)
        self.statistics.table_bytes = self._tables.bytes()

    def _make_traversal(self) -> Driver:
        return make_driver(Setup(self.gpu, self.method, self._tables.samplers(), self.accelerator,
                                 self.options, self.step_cap, find_method, self._prepare_other))

    def _prepare_other(self, method: Method, options: Mapping[str, Any]) -> tuple[
            Samplers, Accelerator]:
        """Another method over the same structure: its tables, made where they are missing."""
        missing = [record for record in method.tables_for(options)
                   if record.name not in self._tables]
        accelerator = self.accelerator
        if missing:
            assert method.adopt is not None
            accelerator = method.adopt(accelerator.structure, self._triangles, options)
            self._write_tables(tuple(missing), accelerator)
        return self._tables.samplers(), accelerator

    # Tracing --------------------------------------------------------------------------------

    @memory_limited
    def trace(self, origins: np.ndarray, directions: np.ndarray,
              t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
              shape: tuple[int, int] | None = None, invalid: str = "raise") -> Hits:
        """Nearest hits.

        Parameters
        ----------
        origins, directions : (n, 3) or (h, w, 3) float, world units; any direction length
        t_min, t_max : scalars or one a ray, in units of |direction|; both ends count
        shape : (h, w) of the tile that (n, 3) rays form
        invalid : "raise", or "miss": rays with NaN, infinity or no direction get status 1

        Raises
        ------
        ValueError
            for arrays that do not fit, or naming the first invalid ray.
        Error
            after ``release``
        """
        batch = RayBatch(origins, directions, t_min, t_max, shape, invalid, self._bounds,
                         self._tiled)
        with self._taking(batch):
            return self._trace(batch, False)

    @memory_limited
    def occluded(self, origins: np.ndarray, directions: np.ndarray,
                 t_max: float | np.ndarray = np.inf, t_min: float | np.ndarray = 0.0,
                 shape: tuple[int, int] | None = None, invalid: str = "raise") -> np.ndarray:
        """(n,) bool: whether anything lies in [t_min, t_max] of each ray; any hit ends a ray.

        Parameters
        ----------
        origins, directions, t_max, t_min, shape, invalid : as for ``trace``

        Raises
        ------
        ValueError
            as for ``trace``
        Error
            as for ``trace``, and where the step cap, or a full stack, leaves it open for some ray
        """
        batch = RayBatch(origins, directions, t_min, t_max, shape, invalid, self._bounds,
                         self._tiled)
        with self._taking(batch):
            hits, cap = self._trace(batch, True), self.step_cap
        for status, advice in ((UNFINISHED, f"reached the step cap of {cap} undecided; "
                                            "raise step_cap"),
                               (STACK_OVERFLOW, "overflowed their stack; raise stack_size")):
            undecided = int(((hits.status == status) & ~hits.hit).sum())
            if undecided:
                raise Error(f"{undecided} rays {advice}")
        return hits.hit

    @memory_limited
    def trace_all(self, origins: np.ndarray, directions: np.ndarray,
                  t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
                  shape: tuple[int, int] | None = None, invalid: str = "raise",
                  max_hits: int | None = None) -> AllHits:
        """All hits, ray by ray in the order of (t, triangle), coincident ones included.

        A round of passes finds the next hit of every ray that had one; ``statistics`` adds up what
        they took, but holds no counters.

        Parameters
        ----------
        origins, directions, t_min, t_max, shape, invalid : as for ``trace``
        max_hits : of a ray, the nearest ones; None for all

        Raises
        ------
        ValueError
            for arrays that do not fit, or naming the first invalid ray.
        OptionError
            under options that round or lose hits, whose order is then not that of (t, triangle).
        """
        for method, own in self._rows.values():
            check_exact(method, own)
        batch = RayBatch(origins, directions, t_min, t_max, shape, invalid, self._bounds,
                         self._tiled)
        with self._taking(batch):
            with self._logged():
                self.statistics.start_call(batch.count)
                self._put_in_order(batch)
                began = time.perf_counter()
                hits = collect(batch, self._trace_on, max_hits)
                self.gpu.check_error(f"tracing all hits of {batch.count} rays")
                self.statistics.trace_seconds = (time.perf_counter() - began
                                                 + batch.sort_seconds)
                self.statistics.sort_seconds += batch.sort_seconds
            if self._rays is not None:
                self._add_texture_bytes()
        return hits

    def _trace_on(self, texels: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """The next hits of rays, (height, width, 3, 4) of RAY_AFTER_HIT: HIT, and their status."""
        rays, buffers = self._room(texels.shape[1::-1], after_hit=True)
        rays.write(texels)
        side, stopped = self._traversal.run(rays, buffers, self.statistics)
        self.statistics.stopped += stopped
        fields, status = side.fields(HIT.name), np.zeros(texels[..., 0, 0].size, np.uint8)
        if stopped:
            mark_stopped(status, side.fields(self.method.state.name)["phase"])
        return fields, status

    def _trace(self, batch: RayBatch, any_hit: bool) -> Hits:
        statistics = self.statistics
        with self.gpu, self._logged():
            statistics.start_call(batch.count)
            self._put_in_order(batch)
            rays, buffers = self._room(batch.size)
            began = time.perf_counter()
            rays.upload(batch)
            self.gpu.finish()
            uploaded = time.perf_counter()
            side, stopped = self._traversal.run(rays, buffers, statistics, any_hit)
            self.gpu.finish()
            traced, sorting = time.perf_counter(), batch.sort_seconds
            statistics.stopped = stopped
            hits = batch.hits(side.fields(HIT.name, batch.by_ray))
            hits = self._finish(hits, side, stopped, batch.by_ray)
            self.gpu.check_error(f"tracing {batch.count} rays")
        statistics.sort_seconds += batch.sort_seconds
        statistics.upload_seconds = uploaded - began
        statistics.trace_seconds = traced - uploaded + batch.sort_seconds
        back = time.perf_counter() - traced
        statistics.readback_seconds = back - (batch.sort_seconds - sorting)
        return hits

    def _put_in_order(self, batch: RayBatch) -> None:
        if self.options["presort"]:
            batch.put_in_order(self._bounds, self.precision)

    @contextmanager
    def _logged(self) -> Iterator[None]:
        """Within, passes are logged where statistics are asked for."""
        if not self.options["statistics"]:
            yield
            return
        with logged(self.gpu, self.statistics) as self.pass_log:
            yield

    def _room(self, size: tuple[int, int],
              after_hit: bool = False) -> tuple[RayTextures, StateBuffers]:
        """Ray textures and state buffers of ``size``; those of the last call if they fit."""
        if self._rays is None or (self._rays.size, self._rays.after_hit) != (size, after_hit):
            self._release_room()
            self._rays = RayTextures(self.gpu, size, self.precision, after_hit)
        if self._buffers is None:
            self._buffers = StateBuffers(self.gpu, self.method.state, size,
                                         self.options["statistics"], self.precision)
        return self._rays, self._buffers

    def _finish(self, hits: Hits, side: StateBuffer | PacketHits, stopped: int,
                by_ray: ByRay = whole) -> Hits:
        """The hits with what became of their rays."""
        if stopped:
            mark_stopped(hits.status, side.fields(
                self.method.state.name, by_ray)["phase"])
        if self.options["statistics"]:
            for name, values in self._count(side, by_ray).items():
                setattr(hits, name, values)
        self._add_texture_bytes()
        return hits

    def _count(self, side: StateBuffer | PacketHits,
               by_ray: ByRay = whole) -> dict[str, np.ndarray]:
        """Counters of the rays by name; their means go to the statistics."""
        counters = {**side.fields(COUNTERS.name, by_ray),
                    "steps": side.fields(self.method.state.name, by_ray)["steps"]}
        self.statistics.counters = {name: float(values.mean()) if len(values) else 0.0
                                    for name, values in counters.items()}
        return counters

    def _add_texture_bytes(self) -> None:
        assert self._rays is not None and self._buffers is not None
        self.statistics.texture_bytes = (
            sum(self.statistics.table_bytes.values()) + self._buffers.bytes()
            + texture_bytes(self._rays.textures) + self._traversal.bytes()
            + (sum(self._integrator.bytes().values()) if self._integrator is not None else 0)
            + self._eye_drivers.bytes() + self._bytes_aside())

    # Lifetime -------------------------------------------------------------------------------

    def _release_room(self) -> None:
        release(self._rays, self._buffers)
        self._rays = self._buffers = None

    def release(self) -> None:
        """Free textures and programs; the tracer is of no use afterwards."""
        with self.gpu:
            if self._released:
                return
            self._released = True
            self._release_room()
            release(self._integrator)
            self._integrator = None
            for held in filter(None, (self._held(), self._aside)):
                release(held["_eye_drivers"], held["_traversal"], held["accelerator"].finisher)
                held["_tables"].keep(())

    def __enter__(self) -> Tracer:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        context = self.options["context"]
        here = {"context": context if isinstance(context, str) else None}
        choices = Choices(*(replace(self.choices.of(rays), options={**options, **here})
                            for rays, (_, options) in self._rows.items()))
        return Tracer, (self.scene, choices)

    def __exit__(self, *exception: object) -> None:
        self.release()
