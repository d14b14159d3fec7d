"""Time travel: the state of every ray after every pass, since every step is a pass.

A pass draws into one of two buffers, and under ``kernels`` only the rays that wait for its kernel:
what the other texels of its target hold is older. A ray's present state is the one with more
steps; steps only grow, so pass by pass the two are put together here.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import OptionError
from ..gl.observation import ObservedPass
from ..gl.target import Target
from ..hits import Hits
from ..rays.batch import RayBatch
from ..rays.records import HIT
from ..tracer import Tracer
from ..traversal.driver import DONE, OVERFLOWN, UNFINISHED
from ..traversal.packet_steps import PacketSteps
from .observe import observe_states

Fields = dict[str, np.ndarray]
INTERSECT = 2    # the phase of packets at a leaf, whose rays are tested by a pass of their own
ENDS = {DONE: "done", UNFINISHED: "stopped by the step cap", OVERFLOWN: "stack full"}


@dataclass
class Pass:
    """All n rays after a pass.

    Attributes
    ----------
    number : 0 for the one that sets states up
    kernel : which ran: "init"; a kernel's name; "all" where each ray runs its own; "visit" or
        "intersect" of packets
    served : rays that each kernel was run on, by its name
    live : rays that are not over
    state, hit : fields of the method's state (of a ray's packet, where packets carry it) and of
        HIT, one entry a ray
    """

    number: int
    kernel: str
    served: dict[str, int]
    live: int
    state: Fields
    hit: Fields

    def to_dict(self) -> dict[str, Any]:
        """What it did, without the states."""
        return {"pass": self.number, "kernel": self.kernel, "served": self.served,
                "live": self.live}


def travel(tracer: Tracer, origins: np.ndarray, directions: np.ndarray,
           look: Callable[[Pass], None], **more: Any) -> Hits:
    """Trace rays and look at all of them after each pass.

    Parameters
    ----------
    tracer : under ``step`` or ``kernels``; under ``loop`` one pass is the whole traversal, and
        OptionError says so
    origins, directions, more : as for ``Tracer.trace``
    look : gets a Pass; its arrays are the caller's to keep

    Returns
    -------
    The hits, as ``Tracer.trace`` returns them.
    """
    batch = RayBatch(origins, directions, bounds=tracer.scene.bounds, **more)
    with tracer.sessions.turn(batch) as session:    # the session that `trace` will use
        if tracer.options["schedule"] == "loop":
            raise OptionError(f"method {tracer.method.name} under schedule loop has one pass to "
                              "look at; take a method with the schedule kernels or step")
        record = _StateRecorder(tracer, batch, look)
        with observe_states(tracer, record.take):
            _, buffers = session.buffers.of(batch.size)
            for side in (0, 1):     # a state of an earlier call may have more steps
                buffers.side(side).clear()
            return tracer.trace(origins, directions, **more)


def decode(batch: RayBatch, one: Pass) -> Hits:
    """What the rays have hit by then, in the caller's units."""
    return batch.hits(one.hit)


def phase_names(tracer: Tracer) -> dict[int, str]:
    """What each value of the state's ``phase`` says."""
    return {**ENDS, **dict(enumerate(_kernels(tracer), 1))}


def _kernels(tracer: Tracer) -> tuple[str, ...]:
    driver = tracer.session.driver
    if isinstance(driver, PacketSteps):
        assert tracer.method.packet_state is not None
        return tracer.method.packet_state(tracer.options).kernels
    return tracer.method.kernels


class _StateRecorder:
    """Puts the states together, pass by pass."""

    def __init__(self, tracer: Tracer, batch: RayBatch, look: Callable[[Pass], None]) -> None:
        self.names, self.look, self.count = phase_names(tracer), look, batch.count
        self.state_name, self.size = tracer.method.state.name, batch.size
        self.packets = isinstance(tracer.session.driver, PacketSteps)
        self.state: Fields = {}
        self.hit: Fields = {}
        self.number = 0

    def take(self, one: ObservedPass) -> None:
        """Add what a pass has changed."""
        kernel, target = one.kernel, one.target
        assert isinstance(target, Target)
        if HIT.name not in target.records:
            self._take_packets(kernel, target)
            return
        hit = self._rays(target.fields(HIT.name))
        if self.packets:    # whose states stay as their last visit left them
            waiting = int((self.state["phase"] == INTERSECT).sum())
            self.hit = hit
            self._show(kernel, {"intersect": waiting} if waiting and kernel != "init" else {})
            return
        state, served = self._rays(target.fields(self.state_name)), {}
        if kernel != "init":
            newer = state["steps"] > self.state["steps"]
            served = self._served(newer)
            state, hit = _newer(newer, state, self.state), _newer(newer, hit, self.hit)
        self.state, self.hit = state, hit
        self._show(kernel, served)

    def _take_packets(self, kernel: str, target: Target) -> None:
        """Packets' states, one texel each, given to their rays."""
        (width, height), across = self.size, target.size[0]
        packet = -(-width // across), -(-height // target.size[1])
        x, y = np.arange(width) // packet[0], np.arange(height) // packet[1]
        of_ray = (x + across * y[:, None]).reshape(-1)
        state = {name: values[of_ray][:self.count]
                 for name, values in target.fields(self.state_name).items()}
        served = {}
        if kernel != "init":
            # Pushing and popping are no steps of a packet, but change what it waits for.
            before = self.state["phase"]
            on = (state["phase"] != before) & (before > INTERSECT)
            served = self._served(on | (state["steps"] > self.state["steps"]))
        self.state = state
        if kernel != "init":    # its rays follow
            self._show(kernel, served)

    def _rays(self, fields: Fields) -> Fields:
        return {name: values[:self.count] for name, values in fields.items()}

    def _served(self, newer: np.ndarray) -> dict[str, int]:
        phases, counts = np.unique(self.state["phase"][newer], return_counts=True)
        return {self.names.get(int(phase), str(phase)): int(count)
                for phase, count in zip(phases, counts)}

    def _show(self, kernel: str, served: dict[str, int]) -> None:
        live = int((self.state["phase"] > DONE).sum())
        self.look(Pass(self.number, kernel, served, live, dict(self.state), dict(self.hit)))
        self.number += 1


def _newer(newer: np.ndarray, now: Fields, before: Fields) -> Fields:
    return {name: np.where(newer.reshape(-1, *[1] * (values.ndim - 1)), values, before[name])
            for name, values in now.items()}
