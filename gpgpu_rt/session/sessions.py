"""Sessions: holds a tracer's one or two sessions (session.py) for one thread at a time."""
from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import Error, OptionError
from ..gl.context import open_gpu
from ..gl.pass_log import PassLog, logged
from ..gl.textures import release
from ..methods import Method, find_method
from ..methods.choices import COHERENT, INCOHERENT, Choices
from ..rays.batch import RayBatch
from ..rays.coherence import coherence
from ..scene.scene import Scene
from ..statistics import Statistics
from ..text_format import counted
from ..views import Facts
from .pictures import Pictures
from .session import Session

# Rays count as coherent when at least this share of neighbouring rays agrees in direction and
# origin. At this share, packets and single rays are about equally fast (docs/notes/schedules.md).
COHERENT_SHARE = 0.7


class Sessions:
    """A single session, or one session for coherent rays and one for incoherent rays.

    The session for incoherent rays is built at the first call with incoherent rays.

    Parameters
    ----------
    choices : The method and the options for each kind of rays.
    rows : The result of ``choices.resolved()``.

    Attributes
    ----------
    chosen : COHERENT or INCOHERENT, the kind of rays that the present session traces.
    statistics : The statistics of the last call.
    pass_log : The passes of the last call, if the option ``statistics`` is on.
    pictures : Draws pictures with the rays of a session.
    """

    def __init__(self, choices: Choices, rows: dict[str, tuple[Method, dict[str, Any]]],
                 scene: Scene) -> None:
        self.choices, self.rows, self.chosen = choices, rows, COHERENT
        self.gpu = open_gpu(self.rows[COHERENT][1]["context"])
        self.statistics = Statistics()
        self.pass_log: PassLog | None = None
        self.pictures = Pictures(self.gpu, self.statistics)
        self._counting = self._released = False
        self._sessions = {COHERENT: Session(self.gpu, *self.rows[COHERENT], scene)}
        self._note_costs()

    @property
    def present(self) -> Session:
        return self._sessions[self.chosen]

    @property
    def held(self) -> tuple[Session, ...]:
        return tuple(self._sessions.values())

    @property
    def any_packets(self) -> bool:
        """Whether one of the methods traces packets, which need rays in tiles."""
        return any(method.packet for method, _ in self.rows.values())

    def remade(self) -> Choices:
        """Return choices from which another process, in its own context, makes equal sessions."""
        context = self.present.options["context"]
        context = context if isinstance(context, str) else None
        return Choices(*(replace(self.choices.of(rays), options={**options, "context": context})
                         for rays, (_, options) in self.rows.items()))

    def facts(self) -> Facts:
        scene = self.present.scene
        found = [("scene", scene.title), ("size", counted(len(scene), "triangle"))]
        for rays, (method, options) in self.rows.items():
            if rays == COHERENT or self.choices.differ:
                defaults = find_method(method.name).resolved({})
                own = ", ".join(f"{name}={value!r}" for name, value in options.items()
                                if name not in ("schedule", "context")
                                and value != defaults.get(name, value))
                found += [("method", method.name
                           + (f" for {rays} rays" if self.choices.differ else "")),
                          ("schedule", str(options["schedule"])), ("options", own)]
        renderer = re.split(r"[ /]*[(/]", self.gpu.renderer)[0] or self.gpu.renderer
        return [*found, ("renderer", renderer), ("state", "released" if self._released else "")]

    # Locking --------------------------------------------------------------------------------

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Lock out other threads within the block. Raise Error after ``release``."""
        with self.gpu:
            if self._released:
                raise Error("this tracer was released, for example at the end of its `with` "
                            "block; make another tracer")
            yield

    @contextmanager
    def turn(self, rays: str | RayBatch) -> Iterator[Session]:
        """Lock out other threads within the block, and yield the session for the rays.

        Parameters
        ----------
        rays : the rays, or their kind, "coherent" or "incoherent"
        """
        with self._alone():
            before = self.present.accelerator.shown
            session = self._choose(rays if isinstance(rays, str) else self._kind_of(rays))
            if session.accelerator.shown is not before:
                self.pictures.follow(session)
            yield session

    @contextmanager
    def call(self, rays: str | RayBatch) -> Iterator[Session]:
        """Do the same as ``turn``; with the option ``statistics``, also log the passes."""
        with self.turn(rays) as chosen:
            if chosen.options["statistics"]:
                with logged(self.gpu, self.statistics) as self.pass_log:
                    yield chosen
            else:
                yield chosen
            self.statistics.texture_bytes = self.pictures.bytes() + sum(
                session.bytes() for session in self.held)

    @contextmanager
    def moving(self) -> Iterator[Session]:
        """Yield the present session. The block may move its triangles; later pictures show the
        move.

        Raises
        ------
        OptionError
            within ``counting``
        Error
            after ``release``
        """
        with self._alone():
            if self._counting:
                raise OptionError("update within counting would move the scene only for the "
                                  "programs that count; update before or after counting")
            session, scene = self.present, self.present.scene
            yield session
            if session.scene is not scene:
                self.pictures.follow(session)
            self._note_costs()

    @contextmanager
    def counting(self) -> Iterator[None]:
        if self.choices.differ:
            raise OptionError("counting needs a tracer with a single method, but this tracer has "
                              "two; make it with statistics=True, or with a single method")
        with self._alone():
            before, counted = self.present, self._counting
            before.buffers.release()
            counting = before.counting()
            self._sessions[self.chosen], self._counting = counting, True
            try:
                yield
            finally:
                self._sessions[self.chosen], self._counting = before, counted
                counting.release()

    # The present session --------------------------------------------------------------------

    def _kind_of(self, batch: RayBatch) -> str:
        """Return COHERENT or INCOHERENT; the present kind if the rays' kind is not known."""
        share = None
        if self.choices.differ:
            lo, hi = self.present.structure.bounds
            share = coherence(batch, float(np.linalg.norm(hi - lo)))
        if share is None:
            return self.chosen
        return COHERENT if share >= COHERENT_SHARE else INCOHERENT

    def _choose(self, kind: str) -> Session:
        """Change the present session to the session for rays of this kind. If building or moving
        that session fails, keep the present session."""
        if kind == self.chosen or not self.choices.differ:
            return self.present
        before, session = self.present, self._sessions.get(kind)
        before.buffers.release()
        if session is None:
            session = self._sessions[kind] = Session(self.gpu, *self.rows[kind], before.scene)
        elif session.scene is not before.scene:     # the scene moved since the session's last call
            session.move(before.scene)
        self.chosen = kind
        self._note_costs()
        return session

    def _note_costs(self) -> None:
        """Write the present session's costs into the statistics."""
        self.statistics.__dict__.update(
            self.present.costs(), choice=self.chosen if self.choices.differ else "")

    def release(self) -> None:
        with self.gpu:
            if not self._released:
                self._released = True
                release(self.pictures, self._sessions)
