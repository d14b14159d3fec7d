"""Work: the fetches and instructions of a method per ray, measured on a sample of a workload."""
from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..errors import Error
from ..hardware.counters import counted
from ..hardware.sample import tile_pixels
from ..tracer import Tracer
from .roofline import FLOPS_AN_INSTRUCTION, Peaks
from .workloads import Workload

BY_RAY = ("drivers/traverse.frag", "drivers/packet")     # programs that traverse a ray or packet
# The sample: tiles of TILE pixels, so that packets are whole, and SPREAD tiles across and down.
TILE, SPREAD = (8, 8), (6, 6)


@dataclass(frozen=True)
class Work:
    """The work of all passes of a call, divided by the number of rays.

    Attributes
    ----------
    texels : texels fetched by fragments
    instructions : scalar instructions, including both sides of branches; a multiply-add counts as
        one
    unknown : the reason if the work is unknown; else ""
    """

    texels: float = 0.0
    instructions: float = 0.0
    unknown: str = ""

    def to_dict(self) -> dict[str, float | str | None]:
        """Return the fields by name; unknown counts are None."""
        if self.unknown:
            return {"texels": None, "instructions": None, "unknown": self.unknown}
        return asdict(self)

    def shares(self, peaks: Peaks, rays_per_second: float) -> dict[str, float | None]:
        """Return the rates of fetches and of instructions, divided by the peak rates of cached
        fetches and of arithmetic; None if unknown."""
        if self.unknown:
            return {"fetch_share": None, "arithmetic_share": None}
        peak = peaks.flops / FLOPS_AN_INSTRUCTION
        return {"fetch_share": self.texels * rays_per_second / peaks.near_texels,
                "arithmetic_share": self.instructions * rays_per_second / peak}


def work_of(tracer: Tracer, rays: Workload) -> Work:
    """Measure a tracer's work on tiles spread over the image of a workload.

    Work that cannot be counted raises no error; the result gives the reason.
    """
    side = rays.size
    if side < max(TILE[0] * SPREAD[0], TILE[1] * SPREAD[1]):
        part = rays.part(np.arange(side * side).reshape(side, side))
    else:
        part = rays.part(tile_pixels(side, TILE, SPREAD))
    if not part.live:
        return Work(unknown="no ray in the sample")
    try:
        passes, _ = counted(tracer, lambda: part.trace(tracer))
    except Error as failure:
        return Work(unknown=" ".join(str(failure).split()))
    if not any(one["name"].startswith(BY_RAY) for one in passes):
        return Work(unknown="its work per ray depends on the number of rays in a call, so a "
                    "sample cannot measure it")
    left = [one["name"] for one in passes if "total" not in one and one["fragments"]]
    if left:
        return Work(unknown=f"{left[0]} cannot be emulated: it masks rays")
    texels = sum(sum(one.get("wanted", one["total"]["fetches"]).values()) for one in passes
                 if "total" in one)
    instructions = sum(one["total"]["scalar"] for one in passes if "total" in one)
    return Work(texels / part.live, instructions / part.live)
