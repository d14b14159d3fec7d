"""Ray buffers: keeps the textures of a call's rays and states for later calls."""
from __future__ import annotations

from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.record import Record
from ..gl.textures import release, texture_bytes
from ..rays.textures import RayTextures, StateBuffers


class RayBuffers:
    """The ray textures and state buffers of the last call.

    A call with the same ``size`` and ``after_hit`` reuses these textures.

    Parameters
    ----------
    state : the record of a ray's state
    statistics : whether states carry counters

    Attributes
    ----------
    rays, states : the textures of the last call, or None before the first call
    """

    def __init__(self, gpu: Gpu, state: Record, precision: Precision, statistics: bool) -> None:
        self.gpu, self.state, self.precision = gpu, state, precision
        self.statistics = statistics
        self.rays: RayTextures | None = None
        self.states: StateBuffers | None = None

    def of(self, size: tuple[int, int], after_hit: bool = False) -> tuple[
            RayTextures, StateBuffers]:
        """Return the textures for rays of ``size`` = (width, height).

        Parameters
        ----------
        after_hit : whether rays continue after an earlier hit (RAY_AFTER_HIT)
        """
        if self.rays is None or (self.rays.size, self.rays.after_hit) != (size, after_hit):
            self.release()
            self.rays = RayTextures(self.gpu, size, self.precision, after_hit)
        if self.states is None:
            self.states = StateBuffers(self.gpu, self.state, size, self.statistics,
                                       self.precision)
        return self.rays, self.states

    def bytes(self) -> int:
        return ((texture_bytes(self.rays.textures) if self.rays is not None else 0)
                + (self.states.bytes() if self.states is not None else 0))

    def release(self) -> None:
        release(self.rays, self.states)
        self.rays = self.states = None
