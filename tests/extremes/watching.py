"""Looks at the state textures after every traversal pass."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.texel_layout import HIT

Fields = dict[str, np.ndarray]


@contextmanager
def watching(tracer: rt.Tracer, look: Callable[[Fields, Fields], None]) -> Iterator[None]:
    """Within, ``look(state, hit)`` gets the target's fields by name, one entry a texel, after each
    pass of the tracer's traversal; the buffers begin as zeros, as fresh textures need not."""
    traversal = tracer._traversal
    if tracer.method.single:
        with _watching_packets(tracer, look):
            yield
        return
    draw = traversal._draw
    names = traversal.method.state.name, HIT.name

    def draw_and_look(program, rays, source, target, *rest, **more) -> None:
        if source is None:
            for side in (0, 1):
                tracer._buffers.side(side).target.clear()
        draw(program, rays, source, target, *rest, **more)
        look(*(target.fields(name) for name in names))
    traversal._draw = draw_and_look
    try:
        yield
    finally:
        del traversal._draw


@contextmanager
def _watching_packets(tracer: rt.Tracer, look: Callable[[Fields, Fields], None]) -> Iterator[None]:
    """Packets keep their state in registers: what they leave behind a whole run is looked at."""
    traversal, run = tracer._traversal, tracer._traversal.run

    def run_and_look(*arguments, **more):
        tracer._buffers.side(0).target.clear()
        side, stopped = run(*arguments, **more)
        look(side.fields(tracer.method.state.name), side.fields(HIT.name))
        return side, stopped
    traversal.run = run_and_look
    try:
        yield
    finally:
        del traversal.run
