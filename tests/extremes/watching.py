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
    if tracer.method.single or not hasattr(traversal, "_draw"):
        stepwise = tracer.options["schedule"] == "step"
        with (_watching_steps if stepwise else _watching_packets)(tracer, look):
            yield
        return
    draw = traversal._draw
    names = traversal.method.state.name, HIT.name

    def draw_and_look(program, rays, source, target, *rest, **more) -> None:
        if source is None:
            for side in (0, 1):
                tracer._buffers.side(side).target.clear()
        draw(program, rays, source, target, *rest, **more)
        look(*(target.fields(name) if name in target.records else {} for name in names))
    traversal._draw = draw_and_look
    try:
        yield
    finally:
        del traversal._draw


@contextmanager
def _watching_packets(tracer: rt.Tracer, look: Callable[[Fields, Fields], None]) -> Iterator[None]:
    """Packets keep their state in registers, and drivers of their own kind elsewhere: what they
    leave behind a whole run is looked at."""
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


@contextmanager
def _watching_steps(tracer: rt.Tracer, look: Callable[[Fields, Fields], None]) -> Iterator[None]:
    """After each pass over the packets their states, after each one over the rays their hits."""
    traversal = tracer._traversal
    visit, intersect = traversal._visit, traversal._intersect

    def visit_and_look(rays, room, source, hits, target, *rest) -> None:
        if source is None:
            for side in room.sides:
                side.target.clear()
        visit(rays, room, source, hits, target, *rest)
        look(target.fields("state"), {})

    def intersect_and_look(rays, packets, source, target, *rest) -> None:
        if source is None:
            for side in (0, 1):
                tracer._buffers.side(side).target.clear()
        intersect(rays, packets, source, target, *rest)
        look(target.fields("state"), target.fields(HIT.name))
    traversal._visit, traversal._intersect = visit_and_look, intersect_and_look
    try:
        yield
    finally:
        del traversal._visit, traversal._intersect
