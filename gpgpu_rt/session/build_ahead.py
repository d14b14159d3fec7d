"""Build ahead: a CPU process builds the next frame's accelerator while passes trace this frame.

B. C. Budge, J. C. Anderson, C. Garth, K. I. Joy, "A Hybrid CPU-GPU Implementation for Interactive
Ray-Tracing of Dynamic Scenes", 2008 (Hachisuka's survey, section 3.4): while the GPU traces frame
n with a stack, the CPU builds the kd-tree of frame n + 1.

Departure: any accelerator that the CPU builds alone can be built ahead. The build runs in a
separate process, because OpenGL calls hold Python's interpreter lock. The process is spawned,
because a fork would inherit the OpenGL context.
"""
from __future__ import annotations

import contextlib
import multiprocessing
import pickle
import time
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..accel.cache import uncached
from ..errors import Error, LimitError, MethodError, OptionError
from ..interrupts import left_to_this_process
from ..methods import Accelerator, find_method
from ..scene.scene import Scene
from .session import Session
from .sessions import Sessions


class Coming(NamedTuple):
    """A scene, and the Future of its accelerator."""

    scene: Scene
    accelerator: Future[Accelerator]


class Builds:
    """A process that builds a session's accelerators, one after another; a context manager.

    Attributes
    ----------
    method : name of the session's method

    Raises
    ------
    OptionError
        if passes build a part of the session's accelerator
    """

    def __init__(self, session: Session) -> None:
        if (session.accelerator.finisher is not None
                or session.options.get("build_device", "cpu") != "cpu"):
            raise OptionError(f"method {session.method.name} builds with passes here, but "
                              "another process cannot run them; move frame by frame with update, "
                              "or leave build_device at cpu")
        self._session, self.method = session, session.method.name
        # A context cannot be sent to another process; builds on the CPU need no context.
        self._options = {**session.options, "context": None}
        self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))

    def begin(self, scene: Scene) -> Coming:
        """Begin to build the accelerator over a scene."""
        triangles = self._session.structure.builder.stored(scene)
        with left_to_this_process(), _one_line_errors(self.method):
            return Coming(scene, self._pool.submit(_build, self.method, self._options, triangles))

    def __enter__(self) -> Builds:
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool.shutdown(cancel_futures=True)


def move_ahead(sessions: Sessions, positions: Iterable[np.ndarray]) -> Iterator[None]:
    """Begin to build the first frame; return an iterator that moves the scene frame by frame.

    Parameters
    ----------
    sessions : the sessions of a tracer with a single method
    positions : the argument of ``Tracer.update`` for each frame

    Raises
    ------
    OptionError
        for a tracer with two methods, or if passes build a part of the accelerator
    SceneError, LimitError
        a frame cannot be built. The first frame's error is raised at once, a later frame's error
        after the move to the preceding frame
    """
    if sessions.choices.differ:
        raise OptionError("building ahead needs a tracer with a single method, but this tracer "
                          "has two; name a method")
    frames = _frames(sessions, iter(positions))
    next(frames)        # begins the first build and returns without waiting for its end
    return frames


def _frames(sessions: Sessions, positions: Iterator[np.ndarray]) -> Iterator[None]:
    """Yield after the start of the first build, then after each move."""
    with sessions.moving() as session:
        builds = Builds(session)
    with builds:
        coming = _begin(builds, sessions, positions)
        yield
        while coming is not None:
            scene, began, failure = coming.scene, time.perf_counter(), None
            with _one_line_errors(builds.method):
                accelerator = coming.accelerator.result()
            waited = time.perf_counter() - began
            try:
                coming = _begin(builds, sessions, positions)
            except Error as problem:    # raise later: the caller first gets the finished frame
                coming, failure = None, problem
            with sessions.moving() as session:
                session.move(scene, accelerator)
                session.build_seconds += waited
            yield
            if failure is not None:
                raise failure


def _begin(builds: Builds, sessions: Sessions,
           positions: Iterator[np.ndarray]) -> Coming | None:
    """Begin to build the next frame; None after the last frame."""
    for vertices in positions:
        return builds.begin(sessions.present.scene.moved(vertices))
    return None


def _build(method: str, options: Mapping[str, Any], triangles: np.ndarray) -> Accelerator:
    """Build an accelerator whose tables hold plain arrays, in the process of `Builds`."""
    with uncached():
        built = find_method(method).prepare(triangles, {**options, "charts": None})
    tables = {name: {field: np.asarray(values) for field, values in table.items()}
              for name, table in built.tables.items()}
    return replace(built, tables=tables)


@contextlib.contextmanager
def _one_line_errors(method: str) -> Iterator[None]:
    """Raise an error of this package if the building process ends early, if memory is lacking, or
    if the process cannot send the accelerator back."""
    try:
        yield
    except BrokenProcessPool as failure:
        raise Error("the process that builds the next frame ended early; in a script, call "
                    "updates under if __name__ == '__main__':") from failure
    except MemoryError as failure:
        raise LimitError("not enough memory to build a frame ahead; move frame by frame with "
                         "update") from failure
    except (pickle.PicklingError, AttributeError, TypeError) as failure:
        if "pickle" not in str(failure):
            raise
        raise MethodError(f"method {method} builds an accelerator that no other process can send "
                          f"({failure}); in prepare, use functools.partial instead of a lambda, "
                          "or move frame by frame with update") from failure
