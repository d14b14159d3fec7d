"""Era rays: keeps samples of the rays of passes in the era form (docs/era.md).

From these samples, era_time.py predicts the time that a card would have taken.
"""
from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import moderngl
import numpy as np

from ..bench.workloads import Workload
from ..gl.observation import ObservedPass, Observer
from ..gl.textures import read_texture
from ..rays.records import RAY_TEXELS
from ..tracer import Tracer
from ..traversal.era_packets import LOOP
from .image_issues import Samples, sampled

# The program RAYS writes a call's rays. In methods without packets, the next pass runs INIT.
RAYS, INIT = "era/rays.frag", "init"
# The first MOST_CALLS calls of each kind (any hit or nearest hit) are kept. The predicted time of
# these calls is scaled up to all calls of the kind (`KeptRays.share`). Their samples have
# 1 / SHRINK of the width and height that `predict` samples: larger samples would multiply the time
# of a prediction.
MOST_CALLS, SHRINK = 4, 2
ANY_HIT = "#define ANY_HIT\n"     # in the fragment text of programs that stop at the first hit


@dataclass(frozen=True)
class KeptCall:
    """Samples of the rays of a call, which asks for any hit or for the nearest hit."""

    any_hit: bool
    samples: Samples


class KeptRays(Observer):
    """Keeps samples of the rays of each call of a tracer with the option ``era``.

    ``calls`` has the kept calls. ``pixels[any_hit]`` is the number of pixels of all calls that ask
    for any hit (True) or for the nearest hit (False).
    """

    def __init__(self, tracer: Tracer) -> None:
        self.tracer = tracer
        self.calls: list[KeptCall] = []
        self.pixels: Counter[bool] = Counter()
        self._written: tuple[moderngl.Texture, ...] = ()    # the outputs of RAYS

    def passed(self, one: ObservedPass) -> None:
        packets = self.tracer.method.era_packets is not None
        if one.name == RAYS:
            self._written = one.outputs
        if one.kernel != (LOOP if packets else INIT):
            return
        # The kernel `init` of some methods does not read the rays, so use what RAYS wrote.
        textures = [one.inputs[f"{RAY_TEXELS.name}_texel_{k}"]
                    for k in range(RAY_TEXELS.texels)] if packets else self._written
        any_hit = ANY_HIT in one.texts[1]
        self.pixels[any_hit] += textures[0].width * textures[0].height
        if sum(kept.any_hit == any_hit for kept in self.calls) == MOST_CALLS:
            return
        texels = np.stack([read_texture(texture) for texture in textures], axis=2)
        flat, shape = texels.reshape(-1, 2, 4), texels.shape[:2]
        empty = flat[:, 0, 3] > flat[:, 1, 3]     # t_min > t_max: a pixel without a shadow ray
        origins = np.where(empty[:, None], np.float32(np.nan), flat[:, 0, :3])
        rays = Workload(origins, flat[:, 1, :3], max(shape), flat[:, 1, 3], any_hit,
                        (shape[0], shape[1]), flat[:, 0, 3])
        chip = str(self.tracer.options["era"]).upper()
        samples = sampled(rays, self.tracer.method.name, chip, SHRINK)
        self.calls.append(KeptCall(any_hit, samples))

    def share(self, any_hit: bool) -> float:
        """Return the number of pixels of the kept calls of a kind, divided by the number of pixels
        of all calls of this kind."""
        return sum(one.samples.pixels for one in self.calls
                   if one.any_hit == any_hit) / max(self.pixels[any_hit], 1)
