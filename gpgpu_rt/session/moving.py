"""Moving: how a tracer follows triangles to where they are now."""
from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ..accel.cache import uncached
from ..errors import OptionError, memory_limited
from ..gl.context import Gpu
from ..methods import Accelerator, Method
from ..render.integrators import Integrator
from ..scene.scene import Scene
from ..statistics import Statistics
from ..traversal.driver import Driver
from ..traversal.stages.eye_drivers import EyeDrivers
from .builder import Builder
from .scene_tables import SceneTables


class Moving:
    """The part of a ``Tracer`` that moves; what it is given here is the tracer's own."""

    gpu: Gpu
    method: Method
    options: dict[str, Any]
    scene: Scene
    accelerator: Accelerator
    statistics: Statistics
    step_cap: int
    _bounds: tuple[np.ndarray, np.ndarray]
    _builder: Builder
    _triangles: np.ndarray
    _tables: SceneTables
    _traversal: Driver
    _integrator: Integrator | None
    _eye_drivers: EyeDrivers
    _counting: bool
    _in_turn: Callable[[], AbstractContextManager[None]]
    _write_tables: Callable[..., None]
    _make_traversal: Callable[[], Driver]
    _hit_triangles: Callable[[], np.ndarray]

    @memory_limited
    def update(self, vertices: np.ndarray) -> None:
        """Trace the scene's triangles where they are now.

        A method whose row has ``refit`` keeps its structure, unless that has become so much worse
        that the option ``rebuild_ratio`` asks for a new one; any other builds anew. ``statistics``
        says which, and what it took. Programs, and textures that still fit, are kept. ``scene`` is
        another one from now on: the one that was given stays as it is.

        Parameters
        ----------
        vertices : (v, 3) float, world units, what the scene's faces count; or (n, 3, 3), the
            triangles themselves, as many as before

        Raises
        ------
        SceneError, LimitError
        OptionError
            within ``counting``
        """
        with self._moving_turn():
            self._move(self.scene.moved(vertices))

    @contextmanager
    def _moving_turn(self) -> Iterator[None]:
        """Within, the scene may move. OptionError within ``counting``, Error after ``release``."""
        with self._in_turn():
            if self._counting:
                raise OptionError("update within counting would move the scene for the programs "
                                  "that count alone; update before or after")
            yield

    def _move(self, scene: Scene) -> None:
        """Trace this scene from now on: of as many triangles, elsewhere."""
        statistics, began = self.statistics, time.perf_counter()
        triangles = self._builder.stored(scene)
        with self.gpu, uncached():
            stored = time.perf_counter()
            accelerator = self._builder.refit(self.accelerator, triangles)
            tried = time.perf_counter() - stored
            statistics.rebuilt = accelerator is None
            if accelerator is None:
                accelerator = self._builder.build(triangles)
            own = self.method.tables_for(self.options)
            self._tables.check(own, accelerator)    # before anything is given up for them
            before, self.accelerator, self._triangles = self.accelerator, accelerator, triangles
            self.scene, self._bounds = scene, scene.bounds
            self._tables.keep(own)    # those of the method for single rays are made again
            self._write_tables(own, accelerator)
            if (before.defines, before.stack_levels) == (accelerator.defines,
                                                         accelerator.stack_levels):
                self._traversal.follow(self._tables.samplers(), accelerator, self.step_cap)
            else:   # other programs, or a stack of another depth
                self._traversal.release()
                self._traversal = self._make_traversal()
            if self._integrator is not None:
                self._integrator.take(self._shown())
            self._eye_drivers.take(self._hit_triangles(), self._traversal)
        took = time.perf_counter() - began
        if statistics.rebuilt:
            statistics.build_seconds, statistics.refit_seconds = took - tried, tried
        else:
            statistics.refit_seconds = took

    def _shown(self) -> Scene:
        """What hits lie on: the scene, or a coarser level of it."""
        shown = self.accelerator.shown
        return self.scene if shown is None else replace(self.scene, triangles=shown)
