"""Trace: records the kernel that each ray runs in each step, from real passes.

Under the schedule ``step``, every pass runs one step of each ray, and the phase in a ray's state
names the kernel of the next step. From the phases, issue.py computes how often groups of pixels
issue each kernel.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import OptionError
from ..gl.observation import ObservedPass
from ..gl.target import Target
from ..inspect.observe import observe_states
from ..inspect.time_travel import kernels_of
from ..rays.records import HIT
from ..tracer import Tracer
from ..traversal.packet_steps import PacketSteps
from ..traversal.packets import packet_of

FINISHED = 0    # the kernel number of a ray that has ended


@dataclass(frozen=True)
class KernelTrace:
    """The kernels of an image's rays, step by step. A packet counts as one ray.

    Attributes
    ----------
    kernels : names of the method's kernels; kernel number k has the name ``kernels[k - 1]``
    steps : (n, h, w) uint8, the number of the kernel that each ray runs in each step; FINISHED
        after the ray's last step
    fields : name of a field of the state -> (n, h, w) int32, the field's value before each step
    """

    kernels: tuple[str, ...]
    steps: np.ndarray
    fields: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def rays(self) -> int:
        """The number of pixels that run at least one kernel."""
        return int((self.steps[0] != FINISHED).sum()) if len(self.steps) else 0

    def runs(self, kernel: str) -> np.ndarray:
        """Return how often each ray runs a kernel, (h, w) int."""
        return (self.steps == self.kernels.index(kernel) + 1).sum(axis=0)

    def totals(self) -> Mapping[str, int]:
        """Return the runs of each kernel, summed over all rays."""
        # Count step by step: bincount makes an int64 copy, of gigabytes for a whole trace.
        counts = sum((np.bincount(step.reshape(-1), minlength=len(self.kernels) + 1)
                      for step in self.steps), np.zeros(len(self.kernels) + 1, np.int64))
        return {name: int(counts[number]) for number, name in enumerate(self.kernels, 1)}


def record_trace(tracer: Tracer, size: tuple[int, int], trace: Callable[[], object],
                 fields: Sequence[str] = ()) -> KernelTrace:
    """Trace the rays of an image and record their kernels.

    Parameters
    ----------
    tracer : a tracer under the schedule ``step``, with one step per pass
    size : (h, w) of the image
    trace : calls ``tracer.trace`` or ``tracer.occluded`` once, with h times w rays row by row
    fields : further integer fields of the state to record

    Raises
    ------
    OptionError
        for another schedule, several steps per pass, or a tracer whose states cannot be observed
    """
    if tracer.options["schedule"] != "step" or tracer.options["steps_per_pass"] != 1:
        raise OptionError(f"method {tracer.method.name} does not run exactly one step of each "
                          "ray per pass; set schedule to step and steps_per_pass to 1")
    state, kernels = tracer.method.state.name, kernels_of(tracer)
    packets = isinstance(tracer.session.driver, PacketSteps)
    across, down = packet_of(tracer.options) if packets else (1, 1)
    size = -(-size[0] // down), -(-size[1] // across)
    found: list[np.ndarray] = []
    values: dict[str, list[np.ndarray]] = {name: [] for name in fields}

    def take(one: ObservedPass) -> None:
        assert isinstance(one.target, Target)
        if packets and HIT.name in one.target.records:
            return      # a pass over rays; another pass writes the packets' states
        states = {name: texels[:size[0] * size[1]].reshape(size)
                  for name, texels in one.target.fields(state).items()
                  if name == "phase" or name in fields}
        phase = states["phase"]
        # A ray whose phase is no kernel's number has ended.
        found.append(np.where((phase >= 1) & (phase <= len(kernels)), phase, FINISHED)
                     .astype(np.uint8))
        for name in fields:
            values[name].append(states[name].astype(np.int32))

    with observe_states(tracer, take):
        trace()
    # The host looks for live rays only every few passes, so the last passes may run no ray.
    while found and not found[-1].any():
        found.pop()
    steps = np.stack(found) if found else np.zeros((0, *size), np.uint8)
    return KernelTrace(kernels, steps, {
        name: np.stack(some[:len(steps)]) if len(steps) else np.zeros(steps.shape, np.int32)
        for name, some in values.items()})
