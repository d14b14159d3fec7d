"""Reads the state textures after every traversal pass."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.gl.target import Target
from gpgpu_rt.inspect.observe import observe_states
from gpgpu_rt.rays.records import HIT

Fields = dict[str, np.ndarray]


@contextmanager
def watching(tracer: rt.Tracer, look: Callable[[Fields, Fields], None]) -> Iterator[None]:
    """Calls ``look(state, hit)`` after each pass of the tracer's traversal.

    The OpenGL context is current during the call.

    ``state`` and ``hit`` map names of fields to arrays with an entry per texel. The state buffers
    are cleared before a traversal, because the content of new textures is undefined.

    ``hit`` is empty for a pass over packets. Some drivers keep no states between passes. Then
    ``look`` is called after each draw into a target of states or hits. Without such a draw,
    ``look`` is called once with the result of the traversal.
    """
    driver, names = tracer.session.driver, (tracer.method.state.name, HIT.name)
    run, seen = driver.run, []

    def look_at(target) -> None:
        seen.append(target)
        look(*(target.fields(name) if name in target.records else {} for name in names))

    def look_at_pass(one) -> None:
        if isinstance(one.target, Target) and set(names) & set(one.target.records):
            look_at(one.target)

    def clear_and_run(*arguments, **more):
        for side in map(tracer.session.buffers.states.side, (0, 1)):
            side.clear()
        seen.clear()
        side, stopped = run(*arguments, **more)
        if not seen:
            look(*(side.fields(name) for name in names))
        return side, stopped
    driver.run = clear_and_run
    observed = (observe_states(tracer, look_at_pass) if driver.keeps_states
                else tracer.observe(look_at_pass))
    try:
        with observed:
            yield
    finally:
        del driver.run
