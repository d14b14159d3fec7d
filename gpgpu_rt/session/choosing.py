"""Choosing: a tracer that has a choice for coherent rays and another for the rest takes between
them by the rays that come, and holds the structures of both once both were asked for; what it
traces with it also puts aside while it counts."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..errors import Error, OptionError
from ..gl.context import Gpu
from ..gl.textures import release
from ..methods import Accelerator, Method
from ..methods.choices import COHERENT, INCOHERENT, Choices
from ..rays.batch import RayBatch
from ..rays.coherence import coherence
from ..render.integrators import Integrator
from ..scene.scene import Scene
from ..statistics import Statistics
from ..traversal.driver import Driver
from ..traversal.stages.eye_drivers import EyeDrivers

# Of neighbouring rays that are alike, from which on rays are coherent: about where packets and
# single rays take as long. What was measured stands in docs/accuracy.md.
SHARE = 0.7
# What a tracer has of each of its choices, as attributes of its own while that one is taken.
HELD = ("method", "options", "precision", "scene", "accelerator", "_bounds", "_builder",
        "_triangles", "_tables", "_traversal", "_eye_drivers")


class Choosing:
    """The part of a ``Tracer`` that holds its choices; what it is given here is the tracer's."""

    gpu: Gpu
    choices: Choices
    scene: Scene
    accelerator: Accelerator
    options: Mapping[str, Any]
    method: Method
    statistics: Statistics
    taken: str                          # the rays that the choice at hand is for
    _aside: dict[str, Any] | None       # what is held of the other one, once it was asked for
    _bounds: tuple[np.ndarray, np.ndarray]
    _integrator: Integrator | None
    _open: Callable[[], None]
    _make_traversal: Callable[[], Driver]
    _move: Callable[[Scene], None]
    _shown: Callable[[], Scene]
    _released: bool
    _counting: bool                     # by programs that `counting` made
    _release_room: Callable[[], None]

    @contextmanager
    def _in_turn(self) -> Iterator[None]:
        """Within, no other thread has this tracer. Error where it was released."""
        with self.gpu:
            if self._released:
                raise Error("this tracer was released, as its `with` block does at its end; "
                            "make another")
            yield

    @contextmanager
    def _taking(self, rays: str | RayBatch) -> Iterator[None]:
        """Within, the choice for such rays is at hand, the one before where they do not tell; and
        no other thread takes another."""
        with self._in_turn():
            self._take(rays if isinstance(rays, str) else self._kind_of(rays))
            yield

    def _kind_of(self, batch: RayBatch) -> str:
        share = None
        if self.choices.differ:
            lo, hi = self._bounds
            share = coherence(batch, float(np.linalg.norm(hi - lo)))
        if share is None:
            return self.taken
        return COHERENT if share >= SHARE else INCOHERENT

    def _take(self, rays: str) -> None:
        if rays == self.taken or not self.choices.differ:
            return
        self._release_room()
        before, other = self._held(), self._aside
        scene, shown = self.scene, self.accelerator.shown
        self.taken = rays
        try:
            if other is None:
                self._open()
            else:
                self._restore(other)
                if self.scene is not scene:     # it moved meanwhile
                    self._move(scene)
        except BaseException:
            self.taken = COHERENT if rays == INCOHERENT else INCOHERENT
            self._restore(before)
            raise
        self._aside = before
        if self._integrator is not None and self.accelerator.shown is not shown:
            self._integrator.take(self._shown())

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Within, rays are counted as with ``statistics=True``, by programs of their own over the
        structure that is there: what is traced before and after is as fast as ever.

        Raises
        ------
        OptionError
            for a tracer that takes between two choices; within, from `update`: the scene stays
            where it is meanwhile
        """
        if self.choices.differ:
            raise OptionError("counting is of one choice, and this tracer takes between two; "
                              "give it statistics=True, or one method")
        with self._in_turn():
            before, counted = self._held(), self._counting
            self._release_room()
            self._counting = True
            try:
                self.options = {**self.options, "statistics": True}
                self._traversal = self._make_traversal()
                self._eye_drivers = EyeDrivers(self.gpu, self.method, self.options)
                yield
            finally:
                self._release_room()
                release(*(mine for mine, old in (
                    (self._eye_drivers, before["_eye_drivers"]),
                    (self._traversal, before["_traversal"])) if mine is not old))
                self._restore(before)
                self._counting = counted

    def _bytes_aside(self) -> int:
        """Bytes of textures that are held of the choice not taken."""
        other = self._aside
        return 0 if other is None else (
            sum(other["_tables"].bytes().values()) + other["_traversal"].bytes()
            + other["_eye_drivers"].bytes())

    def _held(self) -> dict[str, Any]:
        return {**{name: getattr(self, name) for name in HELD},
                "statistics": self.statistics.of_structure()}

    def _restore(self, held: dict[str, Any]) -> None:
        for name in HELD:
            setattr(self, name, held[name])
        self.statistics.__dict__.update(held["statistics"])
