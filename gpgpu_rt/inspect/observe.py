"""Observe: calls a function after each pass, or only after each pass that draws ray states."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import OptionError
from ..gl.observation import Look, ObservedPass, Observer, Passes, observe
from ..gl.target import Target
from ..tracer import Tracer

__all__ = ["Look", "ObservedPass", "Observer", "Passes", "observe", "observe_states"]


class _StateObserver(Observer):
    states = True

    def __init__(self, state: str, look: Look) -> None:
        self.state, self.look = state, look

    def passed(self, one: ObservedPass) -> None:
        if isinstance(one.target, Target) and self.state in one.target.records:
            self.look(one)


@contextmanager
def observe_states(tracer: Tracer, look: Look) -> Iterator[None]:
    """Within the block, call ``look`` after each pass over rays or packets.

    Parameters
    ----------
    look : receives an ObservedPass, whose ``target`` is a Target with the method's state and HIT.
        HIT is missing for packets' states, and in the era form after a kernel that cannot change
        hits. The pass that sets up states has the ``kernel`` "init"

    Raises
    ------
    OptionError
        for the option presort, or a driver that does not keep states in textures between passes
    """
    if tracer.options["presort"]:
        raise OptionError("option presort moves rays to other texels; leave presort out to "
                          "observe rays")
    if not getattr(tracer.session.driver, "keeps_states", False):
        about = next((name for name in ("sort_rays", "entry_points")
                      if tracer.options.get(name)), None)
        raise OptionError(f"option {about} adds passes around the method's own; leave {about} out "
                          "to observe the method's passes" if about else
                          f"method {tracer.method.name} keeps no state of each ray between "
                          "passes; use another method, such as a grid, a kd-tree or a BVH")
    with tracer.gpu.observed(_StateObserver(tracer.method.state.name, look)):
        yield
