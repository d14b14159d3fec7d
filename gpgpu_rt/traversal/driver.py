"""Drivers: what runs a method's programs over the rays; a row names its own by schedule."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import moderngl

from ..gl.context import Gpu
from ..gl.target import Target
from ..rays.textures import RayTextures, StateBuffers
from ..statistics import Statistics
from .method import Accelerator, Method
from .packet_hits import PacketHits

Samplers = dict[str, moderngl.Texture]

# What looks on: called after a pass over the rays' (or packets') states with the kernel that ran,
# what it read (None where it set the states up) and what it drew. A driver that keeps states in
# textures from pass to pass has an attribute ``watch`` for one; see ``inspect/time_travel.py``.
Watch = Callable[[str, Target | None, Target], None]


@dataclass(frozen=True)
class Setup:
    """What a driver is made of.

    Attributes
    ----------
    samplers : sampler name -> texture, the method's tables
    accelerator : uniforms and defines that the method's GLSL asks for
    options : the tracer's and the method's, resolved
    step_cap : steps after which a ray is stopped and flagged
    find_method : name -> row of the method table, for a driver that leaves another method rays
    prepare_other : (method, options) -> samplers and accelerator of another method over the same
        triangles, for a driver that leaves it rays
    """

    gpu: Gpu
    method: Method
    samplers: Samplers
    accelerator: Accelerator
    options: Mapping[str, Any]
    step_cap: int
    find_method: Callable[[str], Method]
    prepare_other: Callable[[Method, Mapping[str, Any]], tuple[Samplers, Accelerator]]


class Driver(Protocol):
    """Runs a method; made of a ``Setup``."""

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        """Trace every ray; where the hits are, and how many rays were stopped unfinished."""

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on: the same records and defines, triangles that moved."""

    def bytes(self) -> int:
        """Bytes of the driver's own textures."""

    def release(self) -> None:
        """Free programs and textures."""
