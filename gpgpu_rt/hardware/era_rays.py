"""Era rays: keeps the rays of passes in the era form, to trace them again step by step.

Some counts of the machine model cannot be seen in the passes of the era form (docs/era.md). They
follow from a trace of the same rays under the schedule ``step`` (`trace.record_trace`).
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from ..gl.observation import ObservedPass, Observer
from ..gl.textures import read_texture
from ..rays.records import RAY_TEXELS
from ..tracer import Tracer
from ..traversal.era_packets import LOOP
from ..traversal.packets import packet_of
from .issue import GROUPS, QUAD
from .trace import KernelTrace, record_trace

# Least side of a tile, in packets or in rays without packets; number of tiles along an axis.
TILE, TILES = 48, 2
# Without packets: the program that writes a call's rays, and the kernel of the next pass.
RAYS, INIT = "era/rays.frag", "init"
# Without packets, only shares follow from the kept rays, so a few calls of each kind (any hit or
# nearest hit) are enough.
MOST_CALLS = 8
ANY_HIT = "#define ANY_HIT\n"     # in the fragment text of programs that stop at the first hit


@dataclass(frozen=True)
class KeptCall:
    """The rays of a call. ``texels``, (h, w, 2, 4), holds the tiles to trace again, side by side.
    ``share`` is the fraction of the call's rays in the tiles, ``pixels`` the number of its rays.
    """

    any_hit: bool
    texels: np.ndarray
    share: float
    pixels: int

    def record(self, stepper: Tracer, fields: Sequence[str] = ()) -> KernelTrace:
        """Trace the tiles with a tracer from `KeptRays.stepper`."""
        flat, shape = self.texels.reshape(-1, 2, 4), self.texels.shape[:2]
        trace = stepper.occluded if self.any_hit else stepper.trace
        return record_trace(stepper, shape, lambda: trace(
            flat[:, 0, :3], flat[:, 1, :3], t_min=flat[:, 0, 3], t_max=flat[:, 1, 3],
            shape=shape, invalid="miss"), fields)


class KeptRays(Observer):
    """Keeps the rays of each call of a tracer with the option ``era``."""

    def __init__(self, tracer: Tracer) -> None:
        self.tracer = tracer
        self.calls: list[KeptCall] = []
        self.kinds: set[bool] = set()   # whether calls were any-hit queries
        self._written: tuple[moderngl.Texture, ...] = ()    # the outputs of RAYS

    def passed(self, one: ObservedPass) -> None:
        packets = self.tracer.method.era_packets is not None
        if one.name == RAYS:
            self._written = one.outputs
        if one.kernel != (LOOP if packets else INIT):
            return
        any_hit = ANY_HIT in one.texts[1]
        self.kinds.add(any_hit)
        if not packets and (len(self.tracer.method.kernels) == 1
                            or sum(kept.any_hit == any_hit for kept in self.calls) == MOST_CALLS):
            return
        across, down = packet_of(self.tracer.options) if packets else (1, 1)
        group = GROUPS[str(self.tracer.options["era"]).upper()] if packets else QUAD
        assert group is not None
        # The kernel `init` of some methods does not read the rays, so use what RAYS wrote.
        textures = [one.inputs[f"{RAY_TEXELS.name}_texel_{k}"]
                    for k in range(RAY_TEXELS.texels)] if packets else self._written
        texels = np.stack([read_texture(texture) for texture in textures], axis=2)
        height, width = texels.shape[:2]
        rows, columns = _sampled(height, down, group[0]), _sampled(width, across, group[1])
        self.calls.append(KeptCall(any_hit, texels[rows][:, columns],
                                   len(rows) * len(columns) / (height * width), height * width))

    @property
    def own(self) -> dict[str, Any]:
        """The options of the tracer's method."""
        return {option.name: self.tracer.options[option.name]
                for option in self.tracer.method.options}

    def stepper(self) -> Tracer:
        """Return a tracer that runs one step of each ray per pass, with the era form's triangle
        test."""
        return Tracer(self.tracer.scene, self.tracer.method.name, schedule="step",
                      steps_per_pass=1, intersection="moller-trumbore",
                      context=self.tracer.options["context"], **self.own)


def _sampled(side: int, packet: int, group: int) -> np.ndarray:
    """Return which rows (or columns) of an image are traced again.

    Trace all of a small image. Divide the axis of a large image into TILES parts, and trace a tile
    in the middle of each part. A tile holds whole groups. The packets of a group branch together.
    """
    tile = -(-TILE // group) * group * packet
    if side <= TILES * tile:
        return np.arange(side)
    starts = ((2 * np.arange(TILES) + 1) * side // (2 * TILES) - tile // 2) // packet * packet
    return (starts[:, None] + np.arange(tile)).reshape(-1)
