"""Time travel: shows the state of every ray after every pass.

Under the schedule ``kernels``, a pass writes only rays that wait for its kernel, into one of two
buffers. The texels of other rays hold older states. A ray's number of steps never decreases. If a
ray's states before and after a pass differ, the state with more steps is newer.
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
from ..methods import family_of, find_method, methods
from ..options import TRACER_OPTIONS, spell
from ..rays.batch import RayBatch
from ..rays.records import HIT
from ..tracer import Tracer
from ..traversal.driver import DONE, OVERFLOWN, UNFINISHED
from ..traversal.method import Method
from ..traversal.packet_steps import PacketSteps
from .observe import observe_states

Fields = dict[str, np.ndarray]
INTERSECT = 2    # the phase of packets at a leaf; a separate pass tests their rays
_ALONE = "runs only under schedule loop, which has one pass to look at"
ENDS = {DONE: "done", UNFINISHED: "stopped by the step cap", OVERFLOWN: "stack full"}


@dataclass
class Pass:
    """All n rays after a pass.

    Attributes
    ----------
    number : Index of the pass; pass 0 sets up states.
    kernel : "init", a kernel's name, or "all" if each ray runs the kernel that its state names.
        For packets, "visit" or "intersect".
    served : Kernel -> number of rays for which it ran in this pass.
    live : Number of unfinished rays.
    state, hit : Fields of the method's state and of HIT, an entry per ray. For a ray of a packet,
        ``state`` also holds the fields of the packet's state.
    """

    number: int
    kernel: str
    served: dict[str, int]
    live: int
    state: Fields
    hit: Fields

    def to_dict(self) -> dict[str, Any]:
        """Return number, kernel and counts as plain data."""
        return {"pass": self.number, "kernel": self.kernel, "served": self.served,
                "live": self.live}


def travel(tracer: Tracer, origins: np.ndarray, directions: np.ndarray,
           look: Callable[[Pass], None], **more: Any) -> Hits:
    """Trace rays and call ``look`` with the states of all rays after each pass.

    Parameters
    ----------
    tracer : a tracer under the schedule ``step`` or ``kernels``
    origins, directions, more : as for ``Tracer.trace``
    look : receives a Pass, whose arrays it may keep

    Returns
    -------
    The hits, as ``Tracer.trace`` returns them.

    Raises
    ------
    OptionError
        under the schedule ``loop``, whose single pass is the whole traversal, or if states cannot
        be observed
    """
    batch = RayBatch(origins, directions, bounds=tracer.scene.bounds, **more)
    with tracer.sessions.turn(batch) as session:    # the session that `trace` will use
        if tracer.options["schedule"] == "loop":
            raise OptionError(_one_pass(tracer))
        record = _StateRecorder(tracer, batch, look)
        with observe_states(tracer, record.take):
            _, buffers = session.buffers.of(batch.size)
            for side in (0, 1):     # remove states of earlier calls, which may have more steps
                buffers.side(side).clear()
            return tracer.trace(origins, directions, **more)


def _one_pass(tracer: Tracer) -> str:
    """Return a message for the schedule ``loop`` that says how to see passes."""
    method, options = tracer.method, tracer.options
    if options["era"]:
        return f"method {method.name} under schedule loop has one pass to look at; leave era out"
    watched = [one for one in method.schedules_for(options) if one != "loop"]
    if watched:
        return (f"method {method.name} under schedule loop has one pass to look at; use the "
                f"schedule {' or '.join(watched)}")
    # tracer.method is the variant for these options. The method's row may have more schedules.
    row = find_method(method.name)
    bound = [o for o in TRACER_OPTIONS + row.options if options[o.name] != o.default
             and {*row.schedules_for({**options, o.name: o.default})} > {"loop"}]
    if not bound:
        return one_pass_alone(row)
    given = ", ".join(f"{o.name}={spell(options[o.name])}" for o in bound)
    return (f"method {method.name} with {given} {_ALONE}; "
            f"leave {' or '.join(o.name for o in bound)} out")


def one_pass_alone(method: Method) -> str:
    """Return a message that names methods to watch, for a method that runs only under ``loop``."""
    relatives = " or ".join(watchable_relatives(method)) or "another method"
    return f"method {method.name} {_ALONE}; watch {relatives}"


def watchable_relatives(method: Method) -> list[str]:
    """Return the methods of the same family (folder of methods) whose passes can be observed. If
    some of these methods agree with ``method`` in the use of stacks and packets, return only those
    methods."""
    family = [row for row in methods() if family_of(row.name) == family_of(method.name)
              and {"step", "kernels"} & set(row.schedules)]
    alike = [row for row in family if (row.stack, row.packet) == (method.stack, method.packet)]
    return [row.name for row in alike or family]


def decode(batch: RayBatch, one: Pass) -> Hits:
    """Return the rays' hits after a pass, in the caller's units."""
    return batch.hits(one.hit)


def phase_names(tracer: Tracer) -> dict[int, str]:
    """Return the meaning of each value of the state's ``phase``."""
    # Only a full stack in textures stops a ray. A full short stack overwrites an entry.
    ends = {phase: name for phase, name in ENDS.items()
            if phase != OVERFLOWN or tracer.method.stack_entry is not None}
    return {**ends, **dict(enumerate(kernels_of(tracer), 1))}


def kernels_of(tracer: Tracer) -> tuple[str, ...]:
    """Return the kernels for which a ray or packet can wait, in the order of phases."""
    driver = tracer.session.driver
    if isinstance(driver, PacketSteps):
        assert tracer.method.packet_state is not None
        return tracer.method.packet_state(tracer.options).kernels
    return tracer.method.kernels


class _StateRecorder:

    def __init__(self, tracer: Tracer, batch: RayBatch, look: Callable[[Pass], None]) -> None:
        self.names, self.look, self.count = phase_names(tracer), look, batch.count
        self.numbers = {name: number for number, name in self.names.items()}
        self.state_name, self.size = tracer.method.state.name, batch.size
        self.packets = isinstance(tracer.session.driver, PacketSteps)
        self.state: Fields = {}
        self.hit: Fields = {}
        self.packet: Fields = {}    # fields of the state that come from the ray's packet
        self.number = 0

    def take(self, one: ObservedPass) -> None:
        """Merge a pass's states with older states."""
        kernel, target = one.kernel, one.target
        assert isinstance(target, Target)
        if self.packets and HIT.name not in target.records:
            self._take_packets(kernel, target)
            return
        state = self._rays(target.fields(self.state_name))
        # In the era form (docs/era.md), kernels that cannot change hits draw only states.
        hit = self._rays(target.fields(HIT.name)) if HIT.name in target.records else self.hit
        served = {}
        if self.packets:    # this pass does not change the packets' states
            waiting = int((self.state["phase"] == INTERSECT).sum())
            own = {name: values for name, values in state.items() if name not in self.packet}
            self.state, self.hit = {**self.packet, **own}, hit
            self._show(kernel, {"intersect": waiting} if waiting and kernel != "init" else {})
            return
        if kernel != "init":
            newer = self._newer_rays(kernel, state)
            served = self._served(newer)
            state, hit = _newer(newer, state, self.state), _newer(newer, hit, self.hit)
        self.state, self.hit = state, hit
        self._show(kernel, served)

    def _newer_rays(self, kernel: str, state: Fields) -> np.ndarray:
        """Return which rays a pass has changed. The target may hold older states of other rays.
        The era form counts no steps; there, a pass changes all rays that wait for its kernel."""
        if "steps" in state:
            return state["steps"] > self.state["steps"]
        return self.state["phase"] == self.numbers[kernel]

    def _take_packets(self, kernel: str, target: Target) -> None:
        (width, height), across = self.size, target.size[0]
        packet = -(-width // across), -(-height // target.size[1])
        x, y = np.arange(width) // packet[0], np.arange(height) // packet[1]
        of_ray = (x + across * y[:, None]).reshape(-1)
        state = {name: values[of_ray][:self.count]
                 for name, values in target.fields(self.state_name).items()}
        served = {}
        if kernel != "init":
            # A push or pop changes the phase without counting as a step.
            before = self.state["phase"]
            on = (state["phase"] != before) & (before > INTERSECT)
            served = self._served(on | (state["steps"] > self.state["steps"]))
        self.packet, self.state = state, {**self.state, **state}
        if kernel != "init":    # after "init", the pass over rays calls `_show`
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
