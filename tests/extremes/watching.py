"""Looks at the state textures after every traversal pass."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.inspect import time_travel
from gpgpu_rt.rays.records import HIT

Fields = dict[str, np.ndarray]


@contextmanager
def watching(tracer: rt.Tracer, look: Callable[[Fields, Fields], None]) -> Iterator[None]:
    """Within, ``look(state, hit)`` gets the target's fields by name, one entry a texel, after each
    pass of the tracer's traversal; the buffers begin as zeros, as fresh textures need not.

    A pass over packets has no hits. Drivers that keep no states from pass to pass are looked at
    after each of their draws of hits, or else after a whole run.
    """
    traversal = tracer.session.driver
    names = tracer.method.state.name, HIT.name

    def clear(but=None) -> None:
        for side in map(tracer.session.buffers.states.side, (0, 1)):
            if side is not but:
                side.clear()

    def watch(kernel, source, target) -> None:
        if source is None and HIT.name in target.records:
            clear(but=target)
        look(*(target.fields(name) if name in target.records else {} for name in names))
    if hasattr(traversal, "watch"):
        with time_travel.watching(tracer, watch):
            yield
        return
    word = "_draw" if hasattr(traversal, "_draw") else "run"
    whole = getattr(traversal, word)

    def draw_and_look(program, rays, source, target, *rest, **more) -> None:
        if source is None:
            clear()
        whole(program, rays, source, target, *rest, **more)
        look(*(target.fields(name) if name in target.records else {} for name in names))

    def run_and_look(*arguments, **more):
        clear()
        side, stopped = whole(*arguments, **more)
        look(*(side.fields(name) for name in names))
        return side, stopped
    setattr(traversal, word, draw_and_look if word == "_draw" else run_and_look)
    try:
        yield
    finally:
        delattr(traversal, word)
