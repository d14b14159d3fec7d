"""Work: what a method does for a ray, from a small sample of a workload, to hold against peaks."""
from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..errors import Error
from ..hardware.counters import counted
from ..hardware.sample import tile_pixels
from ..tracer import Tracer
from .roofline import FLOPS_AN_INSTRUCTION, Peaks
from .workloads import Workload

BY_RAY = ("drivers/traverse.frag", "drivers/packet")     # programs that lead a ray, or a packet
TILE, SPREAD = (8, 8), (6, 6)     # of neighbouring pixels, whole packets; tiles over the image


@dataclass(frozen=True)
class Work:
    """What all passes of a call come to, a ray.

    Attributes
    ----------
    texels : that fragments fetched
    instructions : of scalar units, both sides of branches; a multiply-add counts one
    unknown : why nothing is known; "" where it is
    """

    texels: float = 0.0
    instructions: float = 0.0
    unknown: str = ""

    def to_dict(self) -> dict[str, float | str | None]:
        """Counts that are not known are none."""
        if self.unknown:
            return {"texels": None, "instructions": None, "unknown": self.unknown}
        return asdict(self)

    def shares(self, peaks: Peaks, rays_per_second: float) -> dict[str, float | None]:
        """Of the peak rates of fetching from a cache and of calculating; None if unknown."""
        if self.unknown:
            return {"fetch_share": None, "arithmetic_share": None}
        peak = peaks.flops / FLOPS_AN_INSTRUCTION
        return {"fetch_share": self.texels * rays_per_second / peaks.near_texels,
                "arithmetic_share": self.instructions * rays_per_second / peak}


def work_of(tracer: Tracer, rays: Workload) -> Work:
    """Count a tracer's work on tiles spread over a workload's image; never raises for what
    cannot be counted, but says why."""
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
        return Work(unknown="what it does for a ray depends on how many go together, of which a "
                    "sample says nothing")
    left = [one["name"] for one in passes if "total" not in one and one["fragments"]]
    if left:
        return Work(unknown=f"{left[0]} cannot be emulated: it masks rays")
    texels = sum(sum(one.get("wanted", one["total"]["fetches"]).values()) for one in passes
                 if "total" in one)
    instructions = sum(one["total"]["scalar"] for one in passes if "total" in one)
    return Work(texels / part.live, instructions / part.live)
