"""Structure: a scene's triangles and the accelerator over them, with their textures."""
from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..accel.cache import uncached
from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.textures import release
from ..methods import Accelerator, Method
from ..scene.scene import Scene
from ..traversal.driver import Samplers
from ..traversal.method import Tables
from .builder import Builder
from .scene_tables import SceneTables


class Moved(NamedTuple):
    """The result of `Structure.move`.

    Attributes
    ----------
    rebuilt : whether the accelerator was rebuilt
    tried_seconds : time of the attempt to refit, even if a rebuild followed
    same_programs : whether the compiled programs can read the new tables
    """

    rebuilt: bool
    tried_seconds: float
    same_programs: bool


class Structure:
    """The accelerator of a method over a scene, in textures.

    Parameters
    ----------
    method, options : the method's row in the method table, and a value for each option

    Attributes
    ----------
    scene : the scene with its present triangles
    bounds : ((3,), (3,)) float, the lower and upper corner of the scene's box
    triangles : (n, 3, 3) float32, the triangles as the textures store them
    accelerator : the accelerator over ``triangles``
    tables : the accelerator's arrays as textures
    table_bytes : record name -> bytes of the record's textures. The dict stays the same object,
        because ``Statistics`` refers to it
    """

    def __init__(self, gpu: Gpu, method: Method, options: dict[str, Any], scene: Scene) -> None:
        self.gpu, self.method, self.options = gpu, method, options
        self.precision = Precision.of(options)
        self.scene, self.bounds = scene, scene.bounds
        self.builder = Builder(method, options, scene.charts)
        self.triangles = self.builder.stored(scene)
        self.tables = SceneTables(gpu, self.precision)
        self.table_bytes: dict[str, int] = {}
        with ExitStack() as undo:
            undo.callback(self.tables.keep, ())
            self.accelerator = self.builder.build(self.triangles)
            undo.callback(release, self.accelerator.finisher)
            self.write(method.tables_for(options), self.accelerator)
            undo.pop_all()

    @property
    def shown(self) -> Scene:
        """The surface that rays hit: the scene, or a coarser level of the scene."""
        coarser = self.accelerator.shown
        return self.scene if coarser is None else replace(self.scene, triangles=coarser)

    @property
    def hit_triangles(self) -> np.ndarray:
        """The triangles that rays are tested against, (n, 3, 3) float32, rounded as the method's
        tables store them. A hit on row i gets the triangle index i."""
        coarser = self.accelerator.shown
        return self.triangles if coarser is None else self.builder.stored(self.shown)

    def write(self, records: Tables, accelerator: Accelerator) -> None:
        self.tables.write(records, accelerator)
        accelerator.small_integers = self.tables.small_integers
        self.table_bytes.clear()
        self.table_bytes.update(self.tables.bytes())

    def adopt(self, method: Method, options: Mapping[str, Any]) -> tuple[Samplers, Accelerator]:
        """Return the tables and the accelerator of another method over the same tree. Make missing
        textures."""
        missing = [record for record in method.tables_for(options)
                   if record.name not in self.tables]
        accelerator = self.accelerator
        if missing:
            assert method.adopt is not None
            accelerator = method.adopt(accelerator.structure, self.triangles, options)
            self.write(tuple(missing), accelerator)
        accelerator.small_integers = self.tables.small_integers     # covers all methods' tables
        return self.tables.samplers(), accelerator

    def move(self, scene: Scene, built: Accelerator | None = None) -> Moved:
        """Replace the scene by the same scene with moved triangles.

        Use the accelerator ``built`` over the moved triangles if given. Otherwise refit the
        present accelerator, or rebuild it if the method cannot refit or ``rebuild_ratio`` requires
        a rebuild.

        Raises
        ------
        SceneError, LimitError
            if no accelerator can be built; the structure stays unchanged
        """
        triangles = self.builder.stored(scene)
        own = self.method.tables_for(self.options)
        with uncached():
            began = time.perf_counter()
            refitted = None if built else self.builder.refit(self.accelerator, triangles)
            tried = time.perf_counter() - began
            accelerator = built or refitted or self.builder.build(triangles)
        self.tables.check(own, accelerator)     # before anything changes
        before, self.accelerator, self.triangles = self.accelerator, accelerator, triangles
        self.scene, self.bounds = scene, scene.bounds
        self.tables.keep(own)       # other methods' tables are remade by `adopt` when needed
        self.write(own, accelerator)
        return Moved(refitted is None, tried, (
            (before.defines, before.stack_levels, before.small_integers)
            == (accelerator.defines, accelerator.stack_levels, accelerator.small_integers)))

    def moved_by_passes(self, accelerator: Accelerator, bounds: tuple[np.ndarray, np.ndarray],
                        read_back: tuple[Scene, np.ndarray] | None = None) -> None:
        """Update the structure after passes have moved the triangles within the textures.

        Parameters
        ----------
        accelerator, bounds : the accelerator of the moved triangles, and the corners of their box
        read_back : the moved scene and its stored triangles, (n, 3, 3) float32, or None
        """
        self.accelerator, self.bounds = accelerator, bounds
        accelerator.small_integers = self.tables.small_integers
        if read_back is not None:
            self.scene, self.triangles = read_back
        if any(accelerator.tables[name] is not arrays
               for name, arrays in self.tables.written.items()):
            # Mark triangles without area again: a triangle lost or regained its area.
            self.write(self.method.tables_for(self.options), accelerator)

    def release(self) -> None:
        release(self.accelerator.finisher)
        self.tables.keep(())
